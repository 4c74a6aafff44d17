//! Compiles every row of [`lightfall::shaders::SHADERS`] from `glsl/` into `glsl/spirv/`.
//!
//! Run it as `tools/compile-shaders`, which also finds the GLSL compiler.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use lightfall::shaders::{SHADERS, Shader};
use shaderc::{
    CompileOptions, Compiler, EnvVersion, IncludeCallbackResult, OptimizationLevel,
    ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
};

/// Compile the shaders in glsl/ into glsl/spirv/.
#[derive(Parser)]
#[command(name = "compile-shaders")]
struct Arguments {
    /// Write nothing; fail where glsl/ and glsl/spirv/ have drifted apart.
    #[arg(long)]
    check: bool,
    /// Only shaders whose stem contains one of these words.
    filters: Vec<String>,
}

const GLSL: &str = "glsl";
const SPIRV: &str = "glsl/spirv";
/// What errors in generated declarations point to; written when a shader fails.
const SHARED: &str = "target/shared.glsl";

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// How many shaders failed or drifted.
fn run(arguments: &Arguments) -> Result<usize, Box<dyn std::error::Error>> {
    // Relative paths keep compiler messages clickable.
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR"))?;
    let compiler = Compiler::new()?;
    let shared = lightfall::shared::glsl_header();
    let (mut faults, mut written, mut failed) = (0, 0, false);

    for shader in SHADERS.iter().filter(|shader| wanted(shader, arguments)) {
        let spirv = match compile(&compiler, shader, &shared) {
            Ok(spirv) => spirv,
            Err(message) => {
                eprintln!("{}: {message}", shader.stem);
                faults += 1;
                failed = true;
                continue;
            }
        };
        let path = format!("{SPIRV}/{}.spv", shader.stem);
        if fs::read(&path).is_ok_and(|old| old == spirv) {
            continue;
        }
        if arguments.check {
            eprintln!("{path}: differs from what glsl/{} gives", shader.source);
            faults += 1;
        } else {
            fs::create_dir_all(SPIRV)?;
            fs::write(&path, spirv)?;
            println!("{path}");
            written += 1;
        }
    }
    if failed {
        fs::create_dir_all("target")?;
        fs::write(SHARED, &shared)?;
    }
    for path in orphans()? {
        if arguments.check {
            eprintln!("{path}: no row of SHADERS names it");
            faults += 1;
        } else {
            fs::remove_file(&path)?;
            println!("{path} (deleted)");
            written += 1;
        }
    }

    match (faults, arguments.check) {
        (0, true) => println!("glsl/ and {SPIRV}/ agree"),
        (0, false) => println!("{written} files changed"),
        (_, true) => eprintln!("{faults} faults: run tools/compile-shaders and commit the result"),
        (_, false) => eprintln!("{faults} shaders failed"),
    }
    Ok(faults)
}

fn wanted(shader: &Shader, arguments: &Arguments) -> bool {
    let mut filters = arguments.filters.iter();
    arguments.filters.is_empty() || filters.any(|word| shader.stem.contains(word.as_str()))
}

fn compile(compiler: &Compiler, shader: &Shader, shared: &str) -> Result<Vec<u8>, String> {
    let path = format!("{GLSL}/{}", shader.source);
    let source = fs::read_to_string(&path).map_err(|error| format!("{path}: {error}"))?;
    let mut options = CompileOptions::new().map_err(|error| error.to_string())?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(SpirvVersion::V1_5);
    options.set_optimization_level(OptimizationLevel::Performance);
    options.set_include_callback(|name, _, _, _| include(name, shared));
    for define in shader.defines {
        match define.split_once('=') {
            Some((name, value)) => options.add_macro_definition(name, Some(value)),
            None => options.add_macro_definition(define, Some("1")),
        }
    }
    let binary = compiler
        .compile_into_spirv(&source, stage(shader), &path, "main", Some(&options))
        .map_err(|error| error.to_string())?;
    if binary.get_num_warnings() > 0 {
        eprintln!("{}: {}", shader.stem, binary.get_warning_messages());
    }
    Ok(binary.as_binary_u8().to_vec())
}

/// What its name ends with says; a pass that a ray tracing pipeline runs is a ray generation shader.
fn stage(shader: &Shader) -> ShaderKind {
    match shader.source.rsplit('.').next() {
        Some("rint") => ShaderKind::Intersection,
        Some("rahit") => ShaderKind::AnyHit,
        Some("rchit") => ShaderKind::ClosestHit,
        Some("rmiss") => ShaderKind::Miss,
        _ if shader.defines.contains(&"TRACE_PIPELINE") => ShaderKind::RayGeneration,
        _ => ShaderKind::Compute,
    }
}

/// `shared.glsl` is generated from Rust; every other name is a path below `glsl/`.
/// The guard lets each file include what it needs, however often: GLSL has no `#pragma once`.
fn include(name: &str, shared: &str) -> IncludeCallbackResult {
    let (path, text) = if name == "shared.glsl" {
        (SHARED.to_owned(), shared.to_owned())
    } else {
        let path = format!("{GLSL}/{name}");
        let text = fs::read_to_string(&path).map_err(|error| format!("{path}: {error}"))?;
        (path, text)
    };
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let guard: String = name.chars().map(letter).collect();
    Ok(ResolvedInclude {
        resolved_name: path,
        content: format!(
            "#ifndef included_{guard}\n#define included_{guard}\n#line 1\n{text}\n#endif\n"
        ),
    })
}

/// SPIR-V files that no row names.
fn orphans() -> std::io::Result<BTreeSet<String>> {
    if !Path::new(SPIRV).exists() {
        return Ok(BTreeSet::new());
    }
    let mut orphans = BTreeSet::new();
    for entry in fs::read_dir(SPIRV)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let stem = name.strip_suffix(".spv");
        if stem.is_some_and(|stem| SHADERS.iter().all(|shader| shader.stem != stem)) {
            orphans.insert(format!("{SPIRV}/{name}"));
        }
    }
    Ok(orphans)
}
