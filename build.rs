//! Compiles the entry points in `shaders/` to SPIR-V and writes a table of them for `src/gpu/shader.rs`.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

use shaderc::{
    CompileOptions, Compiler, EnvVersion, IncludeType, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion,
    TargetEnv,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from("shaders");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    // A folder stands for every file in it, includes too.
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build.rs");

    let compiler = Compiler::new()?;
    let options = options(&folder)?;
    let mut entries: Vec<_> =
        fs::read_dir(&folder)?.map(|file| Ok(file?.path())).collect::<Result<_, std::io::Error>>()?;
    entries.sort();

    let mut table = String::new();
    for path in entries {
        let Some(kind) = kind(&path) else { continue };
        let name = path.file_name().and_then(|name| name.to_str()).ok_or("a shader's name is not UTF-8")?;
        let source = fs::read_to_string(&path)?;
        // The path as it is named here stands in messages, so that editors find it.
        let spirv = compiler.compile_into_spirv(&source, kind, &path.to_string_lossy(), "main", Some(&options))?;
        fs::write(out.join(format!("{name}.spv")), spirv.as_binary_u8())?;
        let constant = name.replace('.', "_").to_uppercase();
        writeln!(table, "/// `shaders/{name}`")?;
        writeln!(
            table,
            "pub const {constant}: Shader = Shader {{ name: {name:?}, spirv: include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{name}.spv\")) }};"
        )?;
    }
    fs::write(out.join("shaders.rs"), table)?;
    Ok(())
}

/// The stage of an entry point; files without one are only included.
fn kind(path: &Path) -> Option<ShaderKind> {
    match path.extension()?.to_str()? {
        "vert" => Some(ShaderKind::Vertex),
        "frag" => Some(ShaderKind::Fragment),
        "comp" => Some(ShaderKind::Compute),
        _ => None,
    }
}

fn options(folder: &Path) -> Result<CompileOptions<'static>, Box<dyn Error>> {
    let mut options = CompileOptions::new()?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
    options.set_target_spirv(SpirvVersion::V1_6);
    options.set_optimization_level(OptimizationLevel::Zero);
    options.set_generate_debug_info();
    options.set_warnings_as_errors();
    let folder = folder.to_owned();
    options.set_include_callback(move |name, kind, from, _depth| {
        if kind != IncludeType::Relative {
            return Err(format!("{from}: write #include \"{name}\""));
        }
        let path = folder.join(name);
        let content = fs::read_to_string(&path).map_err(|error| format!("{from}: {}: {error}", path.display()))?;
        Ok(ResolvedInclude { resolved_name: path.to_string_lossy().into_owned(), content })
    });
    Ok(options)
}
