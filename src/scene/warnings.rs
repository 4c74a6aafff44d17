//! What the file asks for and does not get, and what of it breaks a rule and is read all the same.

use std::collections::{HashMap, HashSet};
use std::fmt::Display;

/// Warnings in the order found, one for each kind: its first place, and how many others there are.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    kinds: Vec<Kind>,
    index: HashMap<(String, String), usize>,
    breach: Option<usize>,
}

#[derive(Debug)]
struct Kind {
    what: String,
    first: String,
    places: HashSet<String>,
}

impl Warnings {
    /// Notes that at JSON path `path`, `what` is the case.
    pub fn add(&mut self, path: impl Display, what: impl Display) {
        self.note(path, what);
    }

    /// The same of what glTF forbids and can be given a meaning; `--strict` refuses it.
    pub fn breach(&mut self, path: impl Display, what: impl Display) {
        let kind = self.note(path, what);
        self.breach.get_or_insert(kind);
    }

    fn note(&mut self, path: impl Display, what: impl Display) -> usize {
        let (path, what) = (path.to_string(), what.to_string());
        // The same of another member, such as another factor, is another kind.
        let is_name = |part: &&str| part.parse::<usize>().is_err();
        let member = path.rsplit('/').find(is_name).unwrap_or_default();
        let kind = (member.to_owned(), what.clone());
        let i = *self.index.entry(kind).or_insert_with(|| {
            self.kinds.push(Kind {
                what,
                first: path.clone(),
                places: HashSet::new(),
            });
            self.kinds.len() - 1
        });
        self.kinds[i].places.insert(path);
        i
    }

    /// The first breach, as a sentence.
    pub fn first_breach(&self) -> Option<String> {
        let Kind { what, first, .. } = self.kinds.get(self.breach?)?;
        Some(format!("{first}: {what}"))
    }

    pub fn into_lines(self) -> Vec<String> {
        let line = |kind: Kind| {
            let Kind { what, first, .. } = kind;
            match kind.places.len() {
                0 | 1 => format!("{first}: {what}"),
                2 => format!("{first}: {what} (and at one more place)"),
                n => format!("{first}: {what} (and at {} more places)", n - 1),
            }
        };
        self.kinds.into_iter().map(line).collect()
    }
}
