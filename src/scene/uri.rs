//! URIs: data within the document, or the path of a file.

use std::borrow::Cow;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::asset::Checked;
use super::warnings::Warnings;

/// Padded or not, as its end is known anyway.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The bytes of a data URI (RFC 2397); `None` where `uri`, which stands at `path`, is none. The
/// messages never show it: it can be as long as the scene.
pub(super) fn data(uri: &str, path: &str, warnings: &mut Warnings) -> Checked<Option<Vec<u8>>> {
    let Some((scheme, rest)) = uri.split_once(':') else {
        return Ok(None);
    };
    if !scheme.trim_ascii().eq_ignore_ascii_case("data") {
        return Ok(None);
    }
    if scheme != "data" {
        warnings.breach(
            path,
            "a data URI that does not begin with data:, written so",
        );
    }
    let Some((kind, text)) = rest.split_once(',') else {
        return Err("data URI: has no comma".into());
    };
    let bytes = urlencoding::decode_binary(text.as_bytes());
    let is_base64 = kind.rsplit(';').next().unwrap_or_default();
    if !is_base64.trim_ascii().eq_ignore_ascii_case("base64") {
        return Ok(Some(bytes.into_owned()));
    }
    if text.contains('%') {
        warnings.breach(path, "a data URI with percent-encoded base64");
    }
    let digits = plain_base64(&bytes, path, warnings);
    let data = BASE64.decode(digits);
    data.map(Some)
        .map_err(|error| format!("data URI: base64: {error}"))
}

/// `text` without white space, in the usual alphabet.
fn plain_base64<'a>(text: &'a [u8], path: &str, warnings: &mut Warnings) -> Cow<'a, [u8]> {
    let mut digits = Cow::Borrowed(text);
    if text.iter().any(u8::is_ascii_whitespace) {
        warnings.breach(path, "a data URI with white space in its base64");
        digits.to_mut().retain(|digit| !digit.is_ascii_whitespace());
    }
    if digits.iter().any(|digit| b"-_".contains(digit)) {
        warnings.breach(path, "a data URI in the URL-safe alphabet of base64");
        for digit in digits.to_mut() {
            *digit = match *digit {
                b'-' => b'+',
                b'_' => b'/',
                other => other,
            };
        }
    }
    if !digits.len().is_multiple_of(4) {
        warnings.breach(path, "a data URI whose base64 is not padded");
    }
    digits
}

/// The file names that `uri` can stand for, the likeliest first, each with what is wrong with it
/// where that is not the right way to write it.
pub(super) fn names(uri: &str) -> Checked<Vec<(String, Option<&'static str>)>> {
    let decoded = urlencoding::decode(uri);
    let decoded = decoded.map_err(|_| format!("{}: not UTF-8", shown(uri)))?;
    let scheme = decoded.split_once(':').is_some_and(|(scheme, _)| {
        let mut letters = scheme.chars();
        letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && letters.all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if scheme {
        return Err(format!(
            "{}: only files beside the scene are read; download it and refer to it by name",
            shown(uri)
        ));
    }
    if decoded.starts_with(['/', '\\']) {
        return Err(format!(
            "{}: leads out of the scene's folder; refer to it by a path from there",
            shown(uri)
        ));
    }
    if decoded.is_empty() || decoded.contains('\0') {
        return Err(format!("{:?}: not a file name", shown(uri)));
    }
    let mut names = vec![(decoded.clone().into_owned(), None)];
    if decoded != uri {
        names.push((uri.into(), Some("a file name with a bare % in its URI")));
    }
    if decoded.contains('\\') {
        let fault = "a URI with \\ for /";
        names.push((decoded.replace('\\', "/"), Some(fault)));
    }
    Ok(names)
}

/// Whether `name`, whatever links there are, leads up and out of the folder that it starts in.
pub(super) fn leaves(name: &str) -> bool {
    let mut depth = 0;
    name.split(['/', '\\']).any(|part| {
        depth += match part {
            ".." => -1,
            "." | "" => 0,
            _ => 1,
        };
        depth < 0
    })
}

/// A URI for a message: its beginning.
pub(super) fn shown(uri: &str) -> Cow<'_, str> {
    const MOST: usize = 120;
    match uri.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &uri[..end]).into(),
        None => uri.into(),
    }
}
