//! What images are measured against: a file, or a long render kept for the next bench.

use super::plan::{Budget, Plan};
use super::race::beauty;
use super::{Progress, Session};
use crate::image::{
    Display, Exposure, Layer, Rgb, Tone, luminance, read_layer, read_picture, reduce, write,
};
use crate::metrics::weight;
use crate::render::Renderer;
use crate::scene::Scene;
use crate::settings::{Direct, Settings};
use crate::technique::TECHNIQUES;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The image that is taken for the truth.
pub struct Reference {
    pub image: Rgb,
    /// relMSE that noise alone is expected to leave in it, where that is known; bias is not in it.
    pub own_error: Option<f64>,
    /// Where it came from, in words.
    pub origin: String,
}

/// The unbiased technique.
pub const UNBIASED: &str = "path";
/// Share of the reference's budget that decides which technique renders it.
pub const TRIAL: f64 = 0.05;
/// Path tracing is chosen unless its noise is above this many times the photon map's after the trial…
pub const NOISIER: f64 = 4.0;
/// …or it sees less light than this share of the photon map's: caustics of lamps too small to be hit are lost on it.
pub const DARKER: f64 = 0.98;

/// Far from the seeds under test, which count from 0: halves of a reference.
const SEEDS: [u64; 2] = [0xfffe_0000, 0xffff_0000];

/// The file that `--reference` names for `scene`; `None` where one is to be rendered.
pub fn file(plan: &Plan, scene: &Path) -> Result<Option<PathBuf>> {
    match &plan.reference {
        None => Ok(None),
        Some(path) if path.is_dir() => {
            let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
            let file = path.join(format!("{stem}.exr"));
            Ok(file.exists().then_some(file))
        }
        Some(_) if plan.scenes.len() > 1 => Err(Error::Option {
            option: "--reference",
            fault: "for several scenes, name a folder that holds a file SCENE.exr for each".into(),
        }),
        Some(path) => Ok(Some(path.clone())),
    }
}

/// Reads the image at `path`.
pub fn read(path: &Path) -> Result<Reference> {
    let image = read_layer(path, "")?;
    // lightfall's own renders know the variance of each pixel's luminance.
    let own_error = read_layer(path, "variance").ok().map(|variance| {
        let (pixels, _) = image.pixels.as_chunks();
        let pairs = variance.pixels.iter().step_by(3).zip(pixels);
        let errors = pairs.map(|(v, r)| {
            let y = f64::from(luminance(*r));
            f64::from(*v) / weight(y)
        });
        errors.sum::<f64>() / pixels.len().max(1) as f64
    });
    Ok(Reference {
        image,
        own_error,
        origin: format!("the file {}", path.display()),
    })
}

/// The reference at the size of the images under test, if its pixels are whole blocks of that.
///
/// # Errors
/// They are not.
pub fn at_size(reference: Reference, size: [u32; 2], path: &Path) -> Result<Reference> {
    let [width, height] = reference.image.size;
    let factor = width / size[0];
    if size.map(|edge| edge.checked_mul(factor)) != [Some(width), Some(height)] {
        let fault = format!(
            "is {width} x {height} pixels, which is no multiple of the {} x {} of --size",
            size[0], size[1]
        );
        return Err(Error::image(path, fault));
    }
    Ok(match factor {
        1 => reference,
        _ => Reference {
            image: reduce(&reference.image, factor),
            // Of means of as many pixels, whose noise is independent.
            own_error: reference.own_error.map(|e| e / f64::from(factor * factor)),
            origin: format!("{}, {width} × {height} pixels averaged", reference.origin),
        },
    })
}

/// Takes the cached reference of this scene, camera, size and path length, if it was rendered for as long as the plan says;
/// else renders and caches it. `settings`: those of the image under test.
///
/// Two renders of different seeds make the halves of the reference, so that half their difference is its noise.
///
/// # Errors
/// Rendering failed, or was stopped.
pub fn make(
    plan: &Plan,
    session: &Session,
    scene: &Scene,
    settings: &Settings,
) -> Result<Reference> {
    let say = session.say;
    let path = cache_file(plan, scene, settings);
    if let Ok(reference) = read_cached(&path, plan.reference_budget) {
        say(&format!("reference: {}", path.display()));
        return Ok(reference);
    }
    let start = Instant::now();
    say(&format!(
        "reference: rendering for {}",
        plan.reference_budget.text()
    ));
    let technique = choose(plan, session, scene, settings)?;
    let halves = render(session, scene, settings, technique, plan.reference_budget)?;
    let mut picture = halves.renderer.picture()?;
    picture.metadata.seconds = halves.seconds;
    picture.metadata.iterations = halves.iterations;
    let [a, b] = halves.images;
    picture.layers = vec![
        Layer::new("", &["R", "G", "B"], mean(&a, &b).pixels),
        Layer::new("first half", &["R", "G", "B"], a.pixels),
        Layer::new("second half", &["R", "G", "B"], b.pixels),
    ];
    // The bench goes on without a cache.
    let display = Display {
        exposure: Exposure::Auto,
        tone: Tone::Neutral,
    };
    let folder = std::fs::create_dir_all(&plan.cache).map_err(|e| Error::io(&plan.cache, e));
    if let Err(error) = folder.and_then(|()| write(&path, &picture, &display)) {
        say(&format!("warning: the reference is not kept: {error}"));
    }
    say(&format!(
        "reference: took {:.0} s",
        start.elapsed().as_secs_f64()
    ));
    from_picture(picture)
}

/// The technique to render the reference with: the unbiased one wherever it can see the light.
fn choose(
    plan: &Plan,
    session: &Session,
    scene: &Scene,
    settings: &Settings,
) -> Result<&'static str> {
    let photons = TECHNIQUES
        .iter()
        .find(|row| row.photons)
        .map_or(UNBIASED, |row| row.name);
    if !TECHNIQUES.iter().any(|row| row.name == UNBIASED) {
        return Ok(photons);
    }
    let budget = plan.reference_budget.times(TRIAL);
    let trial = |technique| -> Result<[f64; 2]> {
        let [a, b] = render(session, scene, settings, technique, budget)?.images;
        let light = a
            .pixels
            .iter()
            .zip(&b.pixels)
            .map(|(a, b)| f64::from(a + b))
            .sum();
        Ok([light, noise(&a, &b)])
    };
    let ([path_light, path_noise], [light, noise]) = (trial(UNBIASED)?, trial(photons)?);
    let (brightness, noisiness) = (path_light / light, path_noise / noise);
    (session.say)(&format!(
        "reference: {UNBIASED} sees {:.1} % of the light of {photons} with {noisiness:.2} times its noise",
        100.0 * brightness
    ));
    Ok(if brightness < DARKER || noisiness > NOISIER {
        photons
    } else {
        UNBIASED
    })
}

struct Halves {
    /// Of the first half.
    renderer: Renderer,
    images: [Rgb; 2],
    /// Of both together.
    iterations: u64,
    seconds: f64,
}

fn render(
    session: &Session,
    scene: &Scene,
    settings: &Settings,
    technique: &str,
    budget: Budget,
) -> Result<Halves> {
    let renderer = |seed| {
        let settings = Settings {
            seed,
            technique: technique.into(),
            // Photons would blur the edges of shadows, and who shares that blur would be taken for right.
            direct: Direct::Rays,
            ..settings.clone()
        };
        Renderer::new(session.gpu, scene, &settings)
    };
    let mut halves = [renderer(SEEDS[0])?, renderer(SEEDS[1])?];
    let start = Instant::now();
    let mut progress = Progress::start();
    let done = |halves: &[Renderer; 2]| {
        let iterations = halves[0].iterations() + halves[1].iterations();
        budget.used(iterations, start.elapsed().as_secs_f64())
    };
    // A radius map needs a second iteration to be anything but the pilot's guess.
    while halves[1].iterations() < 2 || done(&halves) < 1.0 {
        progress.update(session, done(&halves));
        for half in &mut halves {
            if (session.stop)() {
                return Err(Error::Option {
                    option: "--reference",
                    fault: "interrupted before the reference was rendered".into(),
                });
            }
            half.iterate()?;
        }
    }
    let images = [beauty(halves[0].picture()?), beauty(halves[1].picture()?)];
    let iterations = halves[0].iterations() + halves[1].iterations();
    let [renderer, _] = halves;
    Ok(Halves {
        renderer,
        images,
        iterations,
        seconds: start.elapsed().as_secs_f64(),
    })
}

fn mean(a: &Rgb, b: &Rgb) -> Rgb {
    let pairs = a.pixels.iter().zip(&b.pixels);
    Rgb {
        size: a.size,
        pixels: pairs.map(|(a, b)| 0.5 * (a + b)).collect(),
    }
}

/// The relMSE that noise leaves in the mean of two halves: they differ by twice that mean's deviation. What it is relative to is the
/// darker half, as a bright dot in one of them would hide itself in the mean.
fn noise(a: &Rgb, b: &Rgb) -> f64 {
    let pairs = a.pixels.iter().zip(&b.pixels);
    let errors = pairs.map(|(a, b)| {
        let (a, b) = (f64::from(*a), f64::from(*b));
        (0.5 * (a - b)).powi(2) / weight(a.min(b))
    });
    let finite = errors.filter(|e| e.is_finite());
    finite.sum::<f64>() / a.pixels.len().max(1) as f64
}

/// Named by all that changes the expected image; the version because renderers are mended.
fn cache_file(plan: &Plan, scene: &Scene, settings: &Settings) -> PathBuf {
    let hash: String = scene
        .hash
        .iter()
        .take(8)
        .map(|b| format!("{b:02x}"))
        .collect();
    let camera = settings.camera.as_deref().unwrap_or("0");
    let camera: String = camera
        .chars()
        .map(|c| if c.is_alphanumeric() { c } else { '_' })
        .collect();
    let [width, height] = settings.size.unwrap_or_default();
    let (depth, version) = (settings.max_depth, env!("CARGO_PKG_VERSION"));
    plan.cache.join(format!(
        "{hash}-{camera}-{width}x{height}-{depth}-{version}.exr"
    ))
}

fn read_cached(path: &Path, wanted: Budget) -> Result<Reference> {
    let picture = read_picture(path)?;
    // A run stops at the first iteration past the budget, so that a tenth less is none less.
    match wanted.used(picture.metadata.iterations, picture.metadata.seconds) >= 0.9 {
        true => from_picture(picture),
        false => Err(Error::image(path, "is rendered too short")),
    }
}

fn from_picture(picture: crate::image::Picture) -> Result<Reference> {
    let size = [picture.width, picture.height];
    let half = |name: &str| Rgb {
        size,
        pixels: picture
            .layers
            .iter()
            .find(|l| l.name == name)
            .map_or_else(Vec::new, |l| l.pixels.clone()),
    };
    let (a, b) = (half("first half"), half("second half"));
    let metadata = &picture.metadata;
    let technique = metadata.settings.split(' ').nth(1).unwrap_or_default();
    Ok(Reference {
        own_error: Some(noise(&a, &b)),
        origin: format!(
            "rendered by lightfall {}, technique {technique}, in {:.0} s ({} iterations, two seeds) on {}",
            metadata.version, metadata.seconds, metadata.iterations, metadata.device
        ),
        image: beauty(picture),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_that_of_the_mean_and_dots_do_not_hide() {
        let half = |pixels: &[f32]| Rgb {
            size: [2, 1],
            pixels: pixels.to_vec(),
        };
        let a = half(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        assert_eq!(noise(&a, &a), 0.0);
        // Each channel of the first pixel is off by 0.1 from the mean of 1.1.
        let b = half(&[1.2, 1.2, 1.2, 2.0, 2.0, 2.0]);
        assert!((noise(&a, &b) - 0.5 * 0.01 / 1.01).abs() < 1e-6);
        let dot = half(&[1000.0, 1000.0, 1000.0, 2.0, 2.0, 2.0]);
        assert!(noise(&a, &dot) > 1e5);
    }
}
