//! GLSL twins of Rust types.
//!
//! Structs are in scalar layout. A [`Ptr<T>`] is a buffer reference named `TRef` with one member, `at[]`. What has no
//! pointers and an even number of words can also be moved by `load_T(reference, index)` and
//! `store_T(reference, index, value)`, two words at once: a CPU device moves what its threads ask for one after the other,
//! however wide it is.

use crate::gpu::Ptr;

/// A type with a GLSL spelling.
pub trait Glsl: 'static {
    /// Its name in GLSL.
    fn name() -> String;
    /// Appends the declarations that the name needs, each once.
    fn declare(_header: &mut Header) {}
    /// Each 32-bit word in order: how to select it, and its type. `None` for what holds pointers.
    fn words() -> Option<Vec<(String, &'static str)>>;
}

/// GLSL text under construction.
#[derive(Default)]
pub struct Header {
    declared: Vec<String>,
    pub text: String,
}

impl Header {
    pub fn add(&mut self, name: String, declaration: &str) {
        if !self.declared.contains(&name) {
            self.declared.push(name);
            self.text += declaration;
        }
    }
}

macro_rules! glsl_primitives {
    ($($rust:ty => $glsl:literal of $scalar:literal $($member:literal)*),* $(,)?) => {$(
        impl Glsl for $rust {
            fn name() -> String {
                $glsl.into()
            }
            fn words() -> Option<Vec<(String, &'static str)>> {
                Some(vec![$(($member.into(), $scalar)),*])
            }
        }
    )*};
}

glsl_primitives! {
    f32 => "float" of "float" "",
    u32 => "uint" of "uint" "",
    [f32; 2] => "vec2" of "float" ".x" ".y",
    [f32; 3] => "vec3" of "float" ".x" ".y" ".z",
    [f32; 4] => "vec4" of "float" ".x" ".y" ".z" ".w",
    [u32; 2] => "uvec2" of "uint" ".x" ".y",
    [u32; 3] => "uvec3" of "uint" ".x" ".y" ".z",
    [u32; 4] => "uvec4" of "uint" ".x" ".y" ".z" ".w",
}

impl<T: Glsl> Glsl for Ptr<T> {
    fn name() -> String {
        T::name() + "Ref"
    }
    fn declare(header: &mut Header) {
        T::declare(header);
        let (name, element) = (Self::name(), T::name());
        header.add(
            name.clone(),
            &format!(
                "layout(buffer_reference, scalar, buffer_reference_align = 4) buffer {name} {{ {element} at[]; }};\n"
            ),
        );
        if let Some(words) = T::words().filter(|words| words.len().is_multiple_of(2)) {
            header.add(element.clone() + "Pairs", &pairs(&element, &words));
        }
    }
    fn words() -> Option<Vec<(String, &'static str)>> {
        None
    }
}

/// GLSL of `load_T` and `store_T` for what has these words.
fn pairs(name: &str, words: &[(String, &str)]) -> String {
    let count = words.len() / 2;
    let (mut load, mut store) = (String::new(), String::new());
    for (i, pair) in words.chunks_exact(2).enumerate() {
        load += &format!("    pair = unpackUint2x32({name}Pairs(from).at[index][{i}]);\n");
        let mut bits = Vec::new();
        for ((member, scalar), word) in pair.iter().zip(["pair.x", "pair.y"]) {
            let [from_bits, to_bits] = match *scalar {
                "float" => ["uintBitsToFloat", "floatBitsToUint"],
                _ => ["uint", "uint"],
            };
            load += &format!("    value{member} = {from_bits}({word});\n");
            bits.push(format!("{to_bits}(value{member})"));
        }
        let bits = bits.join(", ");
        store += &format!("    {name}Pairs(to).at[index][{i}] = packUint2x32(uvec2({bits}));\n");
    }
    format!(
        "layout(buffer_reference, scalar, buffer_reference_align = 8) buffer {name}Pairs {{ uint64_t at[][{count}]; }};\n\
         {name} load_{name}({name}Ref from, uint index) {{\n    {name} value;\n    uvec2 pair;\n{load}    return value;\n}}\n\
         void store_{name}({name}Ref to, uint index, {name} value) {{\n{store}}}\n"
    )
}

macro_rules! shared_structs {
    ($($(#[$meta:meta])* struct $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty,)* })*) => {
        $(
            $(#[$meta])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Pod, Zeroable)]
            pub struct $name { $($(#[$field_meta])* pub $field: $ty,)* }

            impl Default for $name {
                fn default() -> Self {
                    Zeroable::zeroed()
                }
            }

            impl Glsl for $name {
                fn name() -> String {
                    stringify!($name).into()
                }
                fn declare(header: &mut Header) {
                    $(<$ty>::declare(header);)*
                    let fields = [$(format!("    {} {};\n", <$ty>::name(), stringify!($field))),*].concat();
                    header.add(Self::name(), &format!("struct {} {{\n{fields}}};\n", Self::name()));
                }
                fn words() -> Option<Vec<(String, &'static str)>> {
                    let mut words = Vec::new();
                    $(words.extend(
                        <$ty>::words()?
                            .into_iter()
                            .map(|(member, scalar)| (format!(".{}{member}", stringify!($field)), scalar)),
                    );)*
                    Some(words)
                }
            }
        )*

        pub(super) fn declare_structs(header: &mut Header) {
            $(<$name>::declare(header);)*
        }
    };
}

pub(super) use shared_structs;
