//! Error after equal time beside other renderers: renders the scenes that have reference images with
//! no options but size, time and those given, and prints a Markdown table of relMSE.
//!
//! `cargo run --release --example error-table -- ../shared [SECONDS…] [OPTIONS…]`, where the folder
//! holds `scenes/paper` and `references`, and options such as `--direct rays` go to the renderer. Build the program first: `cargo build --release`. The time is
//! that of `lightfall render --time`: it begins before the first iteration, so that loading the scene
//! is excluded and compiling the first iteration's pipelines included.

use std::error::Error;
use std::path::Path;
use std::process::Command;

use lightfall::image::{read_layer, read_picture};
use lightfall::metrics::{Metric, Pair};

/// A scene, part of its image, and what the rivals named in references/README.md reached after 5, 15
/// and 60 s on two CPU cores.
struct Row {
    scene: &'static str,
    part: Part,
    rivals: [&'static str; 3],
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    All,
    /// Where the mask is white: the first hit is neither glass nor mirror.
    White,
    Black,
}

const ROWS: &[Row] = &[
    Row {
        scene: "mcguire-cornell-original",
        part: Part::All,
        rivals: ["path 0.0014", "path 0.0004", ""],
    },
    Row {
        scene: "smallvcm-small-spheres-ceiling",
        part: Part::All,
        rivals: [
            "path 0.094",
            "path 0.034, BiDirVM 0.034",
            "BiDirVM 0.009, path 0.010",
        ],
    },
    Row {
        scene: "rtpm-veach-bidir",
        part: Part::All,
        rivals: [
            "light tracer 0.050",
            "light tracer 0.022, BiDir 0.034",
            "BiDir 0.014",
        ],
    },
    Row {
        scene: "rtpm-water-caustic",
        part: Part::All,
        rivals: [""; 3],
    },
    Row {
        scene: "rtpm-water-caustic",
        part: Part::White,
        rivals: [
            "light tracer 0.029",
            "light tracer 0.012, PhotonGI 0.053",
            "PhotonGI 0.017",
        ],
    },
    Row {
        scene: "rtpm-water-caustic",
        part: Part::Black,
        rivals: ["PhotonGI 0.57", "PhotonGI 0.21", "PhotonGI 0.062"],
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let shared = arguments
        .next()
        .ok_or("usage: error-table FOLDER [SECONDS…] [OPTIONS…]")?;
    let shared = Path::new(&shared);
    let arguments: Vec<String> = arguments.collect();
    let options = arguments.iter().position(|a| a.starts_with('-'));
    let (times, options) = arguments.split_at(options.unwrap_or(arguments.len()));
    let times: Vec<u32> = times.iter().map(|t| t.parse()).collect::<Result<_, _>>()?;
    let times = if times.is_empty() {
        vec![5, 15, 60]
    } else {
        times
    };
    let out = tempfile::tempdir()?;

    println!("| scene | pixels | time | iterations | relMSE | rivals |");
    println!("|---|---|---|---|---|---|");
    for rows in ROWS.chunk_by(|a, b| a.scene == b.scene) {
        let scene = rows[0].scene;
        let reference = read_layer(&shared.join(format!("references/{scene}.exr")), "")?;
        let [width, height] = reference.size;
        for &seconds in &times {
            let image = out.path().join("image.exr");
            let status = Command::new(program()?)
                .arg("render")
                .arg(shared.join(format!("scenes/paper/{scene}.glb")))
                .args(["--quiet", "--size", &format!("{width}x{height}")])
                .args(["--time", &seconds.to_string(), "-o"])
                .arg(&image)
                .args(options)
                .status()?;
            if !status.success() {
                return Err(format!("lightfall render of {scene} failed").into());
            }
            let metadata = read_picture(&image)?.metadata;
            let pixels = read_layer(&image, "")?;
            for row in rows {
                let mask = mask(shared, row, (width * height) as usize)?;
                let pair = Pair::new(&pixels, &reference)?.only(&mask);
                let error = pair.measure(Metric::RelMse).value;
                let rival = match seconds {
                    5 => row.rivals[0],
                    15 => row.rivals[1],
                    60 => row.rivals[2],
                    _ => "",
                };
                println!(
                    "| {scene} | {} | {:.1} s | {} | {error:.4} | {rival} |",
                    row.part.name(),
                    metadata.seconds,
                    metadata.iterations,
                );
            }
        }
    }
    Ok(())
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::White => "white",
            Self::Black => "black",
        }
    }
}

/// The command line program, which lies above the examples.
fn program() -> Result<std::path::PathBuf, Box<dyn Error>> {
    let name = format!("lightfall{}", std::env::consts::EXE_SUFFIX);
    let examples = std::env::current_exe()?;
    let program = examples
        .ancestors()
        .nth(2)
        .unwrap_or(Path::new("."))
        .join(name);
    match program.exists() {
        true => Ok(program),
        false => Err(format!("no {}; run cargo build --release", program.display()).into()),
    }
}

/// Which pixels count.
fn mask(shared: &Path, row: &Row, pixels: usize) -> Result<Vec<bool>, Box<dyn Error>> {
    if row.part == Part::All {
        return Ok(vec![true; pixels]);
    }
    let path = shared.join(format!("references/{}.mask.png", row.scene));
    let mask = image::open(path)?.to_luma8();
    Ok(mask
        .pixels()
        .map(|p| (p.0[0] >= 128) == (row.part == Part::White))
        .collect())
}
