//! The numbers of a glTF file: accessors, and the buffers in which they stand. Every offset and length is checked
//! before it is used.

use super::json::{Accessor, BufferView, Components, Image, Root};
use crate::Error;
use crate::scene::find::{expected, find, folders_of};
use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use glam::{DVec2, DVec3, DVec4};
use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::Read as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The most elements of an accessor without a bufferView, which are zeros that stand in no file.
const MOST_ZEROS: usize = 1 << 18;

/// A picture of a file.
pub(super) enum Picture {
    /// A file, and what messages call it.
    File(PathBuf, String),
    /// The bytes of a picture, and where they stand among others.
    Bytes(Rc<Vec<u8>>, Range<usize>),
}

/// The buffers of a file. Each is read when it is first needed.
pub(super) struct Data<'a> {
    root: &'a Root,
    /// The path of the file.
    path: &'a Path,
    /// The binary part of a GLB file.
    binary: Option<Rc<Vec<u8>>>,
    buffers: HashMap<u32, Rc<Vec<u8>>>,
    /// The files of buffers, which several buffers may share.
    files: HashMap<PathBuf, Rc<Vec<u8>>>,
    /// The files that URIs name, and where those were expected that are not there.
    named: BTreeSet<PathBuf>,
}

/// Elements in a buffer: the bytes from the first one on, and the distance from one to the next.
struct Elements {
    buffer: Rc<Vec<u8>>,
    start: usize,
    stride: usize,
}

impl Elements {
    /// Returns the bytes of element `i` from its byte `at` on.
    fn bytes(&self, i: usize, at: usize) -> &[u8] {
        &self.buffer[self.start + i * self.stride + at..]
    }
}

impl<'a> Data<'a> {
    pub(super) fn new(root: &'a Root, path: &'a Path, binary: Option<Vec<u8>>) -> Data<'a> {
        let binary = binary.map(Rc::new);
        Data { root, path, binary, buffers: HashMap::new(), files: HashMap::new(), named: BTreeSet::new() }
    }

    /// Returns the files that URIs name, and where those were looked for that are not there.
    pub(super) fn into_files(self) -> BTreeSet<PathBuf> {
        self.named
    }

    /// Returns an accessor.
    pub(super) fn accessor(&self, number: u32) -> Result<&'a Accessor, String> {
        self.root.accessors.get(number as usize).ok_or_else(|| format!("there is no accessor {number}"))
    }

    /// Reads an accessor of vectors. It must have `count` of them.
    pub(super) fn vectors(&mut self, number: u32, count: usize) -> Result<Vec<DVec3>, String> {
        if self.accessor(number)?.shape != Components::Vec3 {
            return Err(format!("accessor {number} is not of the type VEC3"));
        }
        self.tuples(number, count, 3, DVec3::from_array)
    }

    /// Reads an accessor of texture coordinates. It must have `count` of them.
    pub(super) fn coordinates(&mut self, number: u32, count: usize) -> Result<Vec<DVec2>, String> {
        if self.accessor(number)?.shape != Components::Vec2 {
            return Err(format!("accessor {number} is not of the type VEC2"));
        }
        self.tuples(number, count, 2, DVec2::from_array)
    }

    /// Reads an accessor of colours, whose alpha is left out.
    pub(super) fn colours(&mut self, number: u32, count: usize) -> Result<Vec<DVec3>, String> {
        match self.accessor(number)?.shape {
            Components::Vec3 => self.tuples(number, count, 3, DVec3::from_array),
            Components::Vec4 => self.tuples(number, count, 4, DVec3::from_array),
            _ => Err(format!("accessor {number} is not of the type VEC3 or VEC4")),
        }
    }

    /// Reads an accessor of single numbers.
    pub(super) fn scalars(&mut self, number: u32) -> Result<Vec<f64>, String> {
        let accessor = self.accessor(number)?;
        if accessor.shape != Components::Scalar {
            return Err(format!("accessor {number} is not of the type SCALAR"));
        }
        self.tuples(number, accessor.count as usize, 1, |[x]| x)
    }

    /// Reads an accessor of four numbers each. It must have `count` of them.
    pub(super) fn quadruples(&mut self, number: u32, count: usize) -> Result<Vec<DVec4>, String> {
        if self.accessor(number)?.shape != Components::Vec4 {
            return Err(format!("accessor {number} is not of the type VEC4"));
        }
        self.tuples(number, count, 4, DVec4::from_array)
    }

    /// Returns the lowest alpha of an accessor of colours, or 1 if it has none.
    pub(super) fn lowest_alpha(&mut self, number: u32, count: usize) -> Result<f64, String> {
        let alphas = match self.accessor(number)?.shape {
            Components::Vec4 => self.tuples(number, count, 4, |[.., alpha]: [f64; 4]| alpha)?,
            _ => Vec::new(),
        };
        Ok(alphas.into_iter().fold(1.0, f64::min))
    }

    /// Makes something of the first N of the `components` of each element.
    fn tuples<const N: usize, T: Clone>(
        &mut self,
        number: u32,
        count: usize,
        components: usize,
        make: impl Fn([f64; N]) -> T,
    ) -> Result<Vec<T>, String> {
        let accessor = self.accessor(number)?;
        let Accessor { component_type, normalized, .. } = *accessor;
        let size = size(number, component_type)?;
        let read = |elements: &Elements, i: usize| {
            make(std::array::from_fn(|axis| component(elements.bytes(i, axis * size), component_type, normalized)))
        };
        self.read(number, count, components * size, make([0.0; N]), read)
    }

    /// Reads an accessor of indices.
    pub(super) fn indices(&mut self, number: u32) -> Result<Vec<u32>, String> {
        let accessor = self.accessor(number)?;
        let component_type = accessor.component_type;
        if accessor.shape != Components::Scalar || !is_index(component_type) {
            return Err(format!("accessor {number} is no list of indices: unsigned numbers of the type SCALAR"));
        }
        let read = |elements: &Elements, i: usize| component(elements.bytes(i, 0), component_type, false) as u32;
        self.read(number, accessor.count as usize, size(number, component_type)?, 0, read)
    }

    /// Reads the `count` elements of an accessor, each of `size` bytes.
    fn read<T: Clone>(
        &mut self,
        number: u32,
        count: usize,
        size: usize,
        zero: T,
        read: impl Fn(&Elements, usize) -> T,
    ) -> Result<Vec<T>, String> {
        let accessor = self.accessor(number)?;
        if accessor.count != count as u64 {
            return Err(format!("accessor {number} has {} elements, and {count} are needed", accessor.count));
        }
        let in_accessor = |what: String| format!("accessor {number}: {what}");
        let mut all = match accessor.buffer_view {
            None if count > MOST_ZEROS => {
                return Err(in_accessor(format!("without a bufferView it may have up to {MOST_ZEROS} elements")));
            }
            None => vec![zero; count],
            Some(view) => {
                let elements = self.elements(view, accessor.byte_offset, count, size).map_err(in_accessor)?;
                (0..count).map(|i| read(&elements, i)).collect()
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let in_sparse = |what: String| format!("the sparse part of accessor {number}: {what}");
            let kind = sparse.indices.component_type;
            if sparse.count > accessor.count || !is_index(kind) {
                return Err(in_sparse("it has more elements than the accessor, or its indices are no indices".into()));
            }
            let (which, values) = (&sparse.indices, &sparse.values);
            let replaced = sparse.count as usize;
            let of_index = self::size(number, kind)?;
            let which = self.elements(which.buffer_view, which.byte_offset, replaced, of_index).map_err(in_sparse)?;
            let values = self.elements(values.buffer_view, values.byte_offset, replaced, size).map_err(in_sparse)?;
            for i in 0..replaced {
                let index = component(which.bytes(i, 0), kind, false) as usize;
                let place = all.get_mut(index).ok_or_else(|| in_sparse(format!("index {index} is out of range")))?;
                *place = read(&values, i);
            }
        }
        Ok(all)
    }

    /// Returns `count` elements of `size` bytes, which begin at `offset` in a buffer view.
    fn elements(&mut self, view: u32, offset: u64, count: usize, size: usize) -> Result<Elements, String> {
        let root = self.root;
        let found = root.buffer_views.get(view as usize).ok_or_else(|| format!("there is no bufferView {view}"))?;
        let &BufferView { buffer, byte_offset, byte_length, byte_stride } = found;
        let bytes = self.buffer(buffer)?;
        let stride = byte_stride.unwrap_or(size as u64);
        if stride < size as u64 {
            return Err(format!("bufferView {view} has a stride of {stride} bytes, and an element has {size}"));
        }
        let claimed = root.buffers[buffer as usize].byte_length.min(bytes.len() as u64);
        if byte_offset.checked_add(byte_length).is_none_or(|end| end > claimed) {
            return Err(format!("bufferView {view} reaches beyond buffer {buffer}, which has {claimed} bytes"));
        }
        let last = (count as u64).saturating_sub(1);
        let end = stride.checked_mul(last).and_then(|x| x.checked_add(size as u64)).and_then(|x| x.checked_add(offset));
        if count > 0 && end.is_none_or(|end| end > byte_length) {
            return Err(format!("{count} elements reach beyond bufferView {view}, which has {byte_length} bytes"));
        }
        // The start lies within the buffer if there are elements, and the stride if there are several.
        Ok(Elements { buffer: bytes, start: (byte_offset + offset.min(byte_length)) as usize, stride: stride as usize })
    }

    /// Returns the picture of an image.
    pub(super) fn picture(&mut self, image: &Image) -> Result<Picture, String> {
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                let bytes = Rc::new(embedded(uri)?);
                let all = 0..bytes.len();
                Ok(Picture::Bytes(bytes, all))
            }
            (Some(uri), _) => {
                // Textures of OBJ files are found in the same way.
                let name = decoded(uri).unwrap_or_default().replace('\\', "/");
                let folders = folders_of(self.path);
                let shown = format!("\"{}\"", Error::shown(&name));
                let found = find(&folders, name.as_bytes());
                let real = found.as_ref().map(|found| found.real.clone()).ok();
                self.named.extend(real.or_else(|| expected(&folders, name.as_bytes())));
                found.map(|found| Picture::File(found.real, shown.clone())).map_err(|why| format!("{shown} {why}"))
            }
            (None, Some(view)) => {
                let length = self.root.buffer_views.get(view as usize).map_or(0, |view| view.byte_length);
                let Elements { buffer, start, .. } = self.elements(view, 0, 1, length as usize)?;
                Ok(Picture::Bytes(buffer, start..start + length as usize))
            }
            (None, None) => Err("it has neither a uri nor a bufferView".into()),
        }
    }

    /// Returns a buffer.
    fn buffer(&mut self, number: u32) -> Result<Rc<Vec<u8>>, String> {
        if let Some(bytes) = self.buffers.get(&number) {
            return Ok(Rc::clone(bytes));
        }
        let root = self.root;
        let buffer = root.buffers.get(number as usize).ok_or_else(|| format!("there is no buffer {number}"))?;
        let bytes = match &buffer.uri {
            None if number == 0 => self.binary.clone().ok_or("buffer 0 has no uri, and the file no binary part")?,
            None => return Err(format!("buffer {number} has no uri")),
            Some(uri) => self.fetch(uri).map_err(|what| format!("buffer {number}: {what}"))?,
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let (claimed, holds) = (buffer.byte_length, bytes.len());
            return Err(format!("buffer {number} claims {claimed} bytes, and has {holds}: it has been cut short"));
        }
        self.buffers.insert(number, Rc::clone(&bytes));
        Ok(bytes)
    }

    /// Finds the file beside the model that a URI names.
    fn file(&mut self, uri: &str) -> Result<PathBuf, String> {
        let name = Error::shown(uri);
        let found = beside(self.path, uri);
        let folder = self.path.parent().map(Path::to_path_buf);
        let expected = || expected(folder.as_slice(), decoded(uri)?.as_bytes());
        self.named.extend(found.clone().or_else(expected));
        found.ok_or_else(|| format!("its file \"{name}\" is not beside the model; files elsewhere are not opened"))
    }

    /// Reads what a URI stands for: the data in it, or a file beside the model.
    fn fetch(&mut self, uri: &str) -> Result<Rc<Vec<u8>>, String> {
        if uri.starts_with("data:") {
            return embedded(uri).map(Rc::new);
        }
        let (name, file) = (Error::shown(uri), self.file(uri)?);
        if let Some(bytes) = self.files.get(&file) {
            return Ok(Rc::clone(bytes));
        }
        let mut bytes = Vec::new();
        let read = File::open(&file).and_then(|file| {
            let length = file.metadata()?.len();
            file.take(length).read_to_end(&mut bytes)
        });
        read.map_err(|e| format!("its file \"{name}\" cannot be read: {e}"))?;
        let bytes = Rc::new(bytes);
        self.files.insert(file, Rc::clone(&bytes));
        Ok(bytes)
    }
}

/// Returns the data in a `data:` URI.
fn embedded(uri: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = uri.split_once(',').ok_or("its data: URI has no comma")?;
    if !kind.ends_with(";base64") {
        return Err("its data: URI is not in base64".into());
    }
    let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    let bytes = GeneralPurpose::new(&STANDARD, config).decode(data);
    bytes.map_err(|e| format!("its data: URI is not in base64: {e}"))
}

/// Finds the regular file that a relative URI names, in the folder of the model or below it. The folder is the one in
/// the model's path, or the one in which the model lies if the path is a symbolic link.
fn beside(model: &Path, uri: &str) -> Option<PathBuf> {
    let name = decoded(uri)?;
    let models = [Some(model.to_path_buf()), model.canonicalize().ok()];
    models.into_iter().flatten().find_map(|model| {
        let folder = model.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = folder.canonicalize().ok()?;
        let file = folder.join(&name).canonicalize().ok()?;
        let regular = fs::metadata(&file).is_ok_and(|file| file.is_file());
        (file.starts_with(&folder) && regular).then_some(file)
    })
}

/// Replaces the escapes of a URI, such as %20. Returns `None` if it is not UTF-8 then.
fn decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let hex = |digit: u8| char::from(digit).to_digit(16).map(|digit| digit as u8);
        let escape = match (first, after) {
            (b'%', [high, low, ..]) => hex(*high).zip(hex(*low)),
            _ => None,
        };
        bytes.push(escape.map_or(*first, |(high, low)| 16 * high + low));
        rest = if escape.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).ok()
}

fn is_index(component_type: u32) -> bool {
    [UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT].contains(&component_type)
}

/// Returns the number of bytes of a component.
fn size(accessor: u32, component_type: u32) -> Result<usize, String> {
    match component_type {
        BYTE | UNSIGNED_BYTE => Ok(1),
        SHORT | UNSIGNED_SHORT => Ok(2),
        UNSIGNED_INT | FLOAT => Ok(4),
        other => Err(format!("accessor {accessor}: there is no componentType {other}")),
    }
}

/// Reads a number, of which `bytes` has enough bytes. A whole number that is normalized stands for one in [0, 1] or
/// [-1, 1].
fn component(bytes: &[u8], component_type: u32, normalized: bool) -> f64 {
    let (x, most) = match component_type {
        BYTE => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        UNSIGNED_BYTE => (f64::from(bytes[0]), f64::from(u8::MAX)),
        SHORT => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        UNSIGNED_SHORT => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        UNSIGNED_INT => (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX)),
        _ => return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    };
    if normalized { (x / most).max(-1.0) } else { x }
}
