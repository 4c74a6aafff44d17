//! The scenes of `../shared/scenes`, where present, against the numbers that their list gives.

use std::path::{Path, PathBuf};

use lightfall::scene::{self};

/// The rows of the list of public scenes: file, triangles, punctual lights, cameras.
#[test]
fn shared_scenes_load_with_the_numbers_of_their_list() {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let Ok(list) = std::fs::read_to_string(folder.join("LICENSES.md")) else {
        println!("skipped: {} is absent", folder.display());
        return;
    };
    let mut scenes = 0;
    for row in list.lines() {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, file, _, triangles, contents, ..] = cells[..] else {
            continue;
        };
        let path = folder.join(file);
        let (Ok(triangles), true) = (triangles.parse::<usize>(), path.is_file()) else {
            continue;
        };
        scenes += 1;
        let start = std::time::Instant::now();
        let result = scene::load(&path);
        let time = start.elapsed().as_millis();
        let scene = result.unwrap();
        println!(
            "{file}: {} of {triangles} triangles, {} vertices, {} lights, {} cameras ({contents}), {time} ms",
            scene.triangles.len(),
            scene.vertices.len(),
            scene.lights.len(),
            scene.cameras.len()
        );
        for warning in &scene.warnings {
            println!("    {warning}");
        }
        let contents: Vec<usize> = contents
            .split('/')
            .map(|n| n.trim().parse().unwrap())
            .collect();
        assert_eq!(scene.lights.len(), contents[1], "{file}");
        let skipped = scene.warnings.iter().filter(|w| w.starts_with("/cameras/"));
        assert_eq!(
            scene.cameras.len() + skipped.count(),
            contents[2].max(1),
            "{file}"
        );
        // The list counts meshes once.
        let instances = if file.contains("SimpleInstancing") {
            125
        } else {
            1
        };
        assert!(scene.triangles.len() <= triangles * instances, "{file}");
        assert!(
            scene.triangles.len() > triangles * (instances - 1),
            "{file}"
        );
    }
    assert!(scenes > 50, "only {scenes} scenes of the list were found");
}
