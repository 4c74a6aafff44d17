//! The device layer, under the validation layer where that is installed.
//! The shaders are `tests/shaders/*.{comp,rgen}`, compiled by `glslangValidator -V -g0 --target-env vulkan1.2`.

mod rays;
mod textures;
mod work;

use lightfall::Error;
use lightfall::gpu::{Gpu, OpenOptions, devices};

fn open() -> Gpu {
    let options = OpenOptions {
        device: None,
        validate: true,
    };
    Gpu::open(&options).expect("a Vulkan device: install mesa-vulkan-drivers")
}

/// The validation layer must have had nothing to say.
fn assert_valid(gpu: &Gpu) {
    assert_eq!(gpu.validation_messages(), Vec::<String>::new());
}

#[test]
fn devices_are_chosen_by_index_or_name() {
    let infos = devices().unwrap();
    let open = |device: &str| {
        let options = OpenOptions {
            device: Some(device),
            validate: false,
        };
        Gpu::open(&options)
    };
    for info in infos.iter().filter(|info| info.usable()) {
        let by_index = open(&info.index.to_string()).unwrap();
        assert_eq!(by_index.info().index, info.index);
        let by_name = open(&info.name.to_uppercase()).unwrap();
        assert_eq!(by_name.info().name, info.name);
    }
    let Err(Error::Option { option, fault }) = open("Voodoo 2") else {
        panic!("a Voodoo 2?");
    };
    assert_eq!(option, "--device");
    assert!(fault.contains(&infos[0].name), "{fault}");
    assert!(matches!(open("99"), Err(Error::Option { .. })));
}

#[test]
fn the_doctor_finds_every_usable_device_fit() {
    let mut report = Vec::new();
    lightfall::cli::doctor::report(&mut report).unwrap();
    let report = String::from_utf8(report).unwrap();
    for info in devices().unwrap() {
        let (index, name) = (info.index, info.name);
        assert!(
            report.contains(&format!("Device {index}: {name}")),
            "{report}"
        );
    }
    assert!(
        report.contains("4096 device addresses followed"),
        "{report}"
    );
    assert!(
        !report.contains("BAD") && !report.contains("FAILED"),
        "{report}"
    );
    assert!(report.contains("Without --device"), "{report}");
    for info in devices().unwrap().iter().filter(|info| info.usable()) {
        for (there, by) in [
            (info.caps.ray_query, "ray query"),
            (info.caps.ray_tracing_pipeline, "pipelines"),
        ] {
            let good = format!("0 missed, 0 reported twice by {by}");
            assert!(!there || report.contains(&good), "{report}");
        }
    }
}
