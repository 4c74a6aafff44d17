//! The files that a scene refers to, read within the folders that it may see.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::asset::Checked;
use super::load::LoadOptions;
use super::uri::{self, shown};
use super::warnings::Warnings;

/// All bytes read for one scene, together. A file list that names a large file again and again
/// cannot ask for more.
const MAX_BYTES: u64 = 8 << 30;

/// Reads what the scene refers to and hashes it on the way.
pub(super) struct Resources {
    /// Where relative paths start: beside the scene as it is named, then beside what it links to.
    bases: Vec<PathBuf>,
    /// What a file must lie in, links followed: an archive can hold those too.
    roots: Vec<PathBuf>,
    root_named: bool,
    hasher: blake3::Hasher,
    files: HashMap<PathBuf, Rc<[u8]>>,
    bytes_left: u64,
}

impl Resources {
    /// For the scene in the file `path`, which has the content `main`.
    pub fn new(path: &Path, main: &[u8], options: &LoadOptions) -> std::io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(main);
        let mut bases = vec![folder(path)];
        let real = path.canonicalize()?;
        if !options.strict {
            bases.push(folder(&real));
        }
        let mut roots = Vec::new();
        for folder in bases.iter().chain(&options.root) {
            roots.push(folder.canonicalize()?);
        }
        Ok(Self {
            bases,
            roots,
            root_named: options.root.is_some(),
            hasher,
            files: HashMap::from([(real, Rc::from([]))]),
            bytes_left: MAX_BYTES,
        })
    }

    /// blake3 of the scene file and of every external file, each once, in the order of reference.
    pub fn hash(&self) -> [u8; 32] {
        *self.hasher.finalize().as_bytes()
    }

    /// Where the scene file and all that it refers to really lie.
    pub fn into_paths(self) -> Vec<PathBuf> {
        self.files.into_keys().collect()
    }

    /// The bytes behind `uri`, which stands at `path`: a data URI, or a file.
    pub fn fetch(&mut self, uri: &str, path: &str, warnings: &mut Warnings) -> Checked<Rc<[u8]>> {
        if let Some(data) = uri::data(uri, path, warnings)? {
            return Ok(data.into());
        }
        let mut fault = None;
        for (name, breach) in uri::names(uri)? {
            if !self.root_named && uri::leaves(&name) {
                return Err(format!("{}: {}", shown(uri), self.outside()));
            }
            for base in self.bases.clone() {
                match self.read(&base.join(&name)) {
                    Ok(bytes) => {
                        if let Some(breach) = breach {
                            warnings.breach(path, breach);
                        }
                        return Ok(bytes);
                    }
                    Err(error) if error.kind() == ErrorKind::NotFound => {
                        fault.get_or_insert(error);
                    }
                    Err(error) => return Err(format!("{}: {error}", shown(uri))),
                }
            }
        }
        let fault = fault.unwrap_or_else(|| ErrorKind::NotFound.into());
        Err(format!("{}: {fault}", shown(uri)))
    }

    fn read(&mut self, path: &Path) -> std::io::Result<Rc<[u8]>> {
        let path = path.canonicalize()?;
        if !self.roots.iter().any(|root| path.starts_with(root)) {
            return Err(Error::other(self.outside()));
        }
        if let Some(bytes) = self.files.get(&path).filter(|bytes| !bytes.is_empty()) {
            return Ok(bytes.clone());
        }
        let bytes: Rc<[u8]> = read_file(&path, self.bytes_left)?.into();
        self.bytes_left -= bytes.len() as u64;
        self.hasher.update(&bytes);
        self.files.insert(path, bytes.clone());
        Ok(bytes)
    }

    fn outside(&self) -> &'static str {
        match self.root_named {
            true => "leads out of the scene's folder and of the one that --root names",
            false => {
                "leads out of the scene's folder; to allow that, name a folder that holds both: \
                 --root DIR"
            }
        }
    }
}

/// The folder that the file `path` lies in.
fn folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.into(),
        _ => ".".into(),
    }
}

/// Reads a regular file of at most `limit` bytes: a pipe or a device could keep us for ever.
fn read_file(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let fault = |text: &str| Err(Error::other(text));
    if !std::fs::metadata(path)?.is_file() {
        return fault("not a regular file");
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return fault("the scene's files together are larger than 8 GiB");
    }
    Ok(bytes)
}

/// Reads the scene file itself, within the same limit.
pub(super) fn read_main(path: &Path) -> std::io::Result<Vec<u8>> {
    read_file(path, MAX_BYTES)
}
