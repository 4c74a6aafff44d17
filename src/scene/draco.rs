//! KHR_draco_mesh_compression: the triangles of a primitive and the attributes of their corners.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json::Value;
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::Decoded;
use super::asset::{Asset, Checked};
use super::guard::guarded;
use super::warnings::Warnings;

const NAME: &str = "KHR_draco_mesh_compression";

/// A decoded primitive.
pub(super) struct Draco<'a> {
    mesh: Mesh,
    /// The stream's number for each attribute that it holds.
    ids: &'a Value,
}

impl<'a> Draco<'a> {
    /// Decodes the primitive at `path`. `None` where it is not compressed, or where it cannot be
    /// decoded and the file has the same once more, uncompressed.
    pub fn open(
        asset: &Asset,
        json: &'a Primitive,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<Option<Self>> {
        let fault = match Self::decode(asset, json, path, warnings) {
            Ok(draco) => return Ok(draco),
            Err(fault) => fault,
        };
        let position = json.attributes.get(&Valid(Semantic::Positions));
        let position = position.and_then(|index| asset.root.accessors.get(index.value()));
        if position.is_none_or(|accessor| accessor.buffer_view.is_none()) {
            return Err(fault);
        }
        warnings.breach(path, format_args!("not decoded: {fault}"));
        Ok(None)
    }

    fn decode(
        asset: &Asset,
        json: &'a Primitive,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<Option<Self>> {
        let extensions = json.extensions.as_ref();
        let Some(extension) = extensions.and_then(|all| all.others.get(NAME)) else {
            return Ok(None);
        };
        let path = format!("{path}/extensions/{NAME}");
        let view = extension.get("bufferView").and_then(Value::as_u64);
        let view = view.and_then(|i| u32::try_from(i).ok());
        let view = view.ok_or_else(|| format!("{path}/bufferView: must be an index"))?;
        let (_, stream) = asset.view(gltf::json::Index::new(view), &path, warnings)?;
        let (elements, bytes) = asset.limits();
        let limits = DecodeLimits::default()
            .with_max_points(elements)
            .with_max_faces(elements / 3)
            .with_max_decoded_bytes(bytes);
        let mesh = guarded(|| {
            let mut mesh = Mesh::new();
            let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
            let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
            decoded.map_err(|error| error.to_string())?;
            Ok(mesh)
        });
        let mesh = mesh.map_err(|fault| format!("{path}: {fault}"))?;
        // Indices, and for each point no more than four components of four bytes are kept.
        let size = mesh.num_faces() * 12 + mesh.num_points() * 16;
        asset.charge_decoded(size as u64, &path)?;
        let ids = extension.get("attributes").unwrap_or(&Value::Null);
        Ok(Some(Self { mesh, ids }))
    }

    /// Three for each triangle.
    pub fn indices(&self) -> Decoded {
        let faces = self.mesh.faces().iter().flatten();
        Decoded {
            count: self.mesh.num_faces() * 3,
            component: ComponentType::U32,
            bytes: faces.flat_map(|point| point.0.to_le_bytes()).collect(),
        }
    }

    /// The attribute `name`, of `components` of the type `component`; `None` where the stream does
    /// not hold it.
    pub fn attribute(
        &self,
        name: &str,
        components: usize,
        component: ComponentType,
    ) -> Checked<Option<Decoded>> {
        let Some(id) = self.ids.get(name).and_then(Value::as_u64) else {
            return Ok(None);
        };
        let id = u32::try_from(id).unwrap_or(u32::MAX);
        let attribute = self.mesh.attribute_by_unique_id(id);
        let attribute =
            attribute.ok_or_else(|| format!("the Draco stream has no attribute {id}"))?;
        if usize::from(attribute.num_components()) != components {
            return Err(format!(
                "the Draco stream's attribute {id} has another type"
            ));
        }
        let count = self.mesh.num_points();
        let values = guarded(|| Ok(attribute.read_f32s(count, components)))?;
        let bytes = match component {
            ComponentType::I8 => values.iter().map(|x| *x as i8 as u8).collect(),
            ComponentType::U8 => values.iter().map(|x| *x as u8).collect(),
            ComponentType::I16 => values
                .iter()
                .flat_map(|x| (*x as i16).to_le_bytes())
                .collect(),
            ComponentType::U16 => values
                .iter()
                .flat_map(|x| (*x as u16).to_le_bytes())
                .collect(),
            ComponentType::U32 => values
                .iter()
                .flat_map(|x| (*x as u32).to_le_bytes())
                .collect(),
            ComponentType::F32 => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        };
        Ok(Some(Decoded {
            count,
            component,
            bytes,
        }))
    }
}
