//! The numbers of accessors. In flow accessors and buffers, out flow arrays; what does not fit together is an error.

use std::cell::Cell;
use std::rc::Rc;

use gltf::accessor::sparse::IndexType;
use gltf::accessor::{Accessor, DataType, Dimensions};

use super::container::{Bytes, slice};

/// How many bytes of numbers are read at most for each byte of the buffers: accessors may share bytes, not without end.
const MOST_SHARED: usize = 16;

/// The same of numbers that are all zero, which take no bytes.
const MOST_ZEROS: usize = 1 << 22;

/// The buffers of a file.
pub struct Accessors<'a> {
    buffers: &'a [Bytes<'a>],
    left: Cell<usize>,
    bytes: usize,
}

impl<'a> Accessors<'a> {
    /// Of these buffers.
    pub fn new(buffers: &'a [Bytes<'a>]) -> Self {
        let is_new =
            |&(number, bytes): &(usize, &Bytes<'_>)| !buffers[..number].iter().any(|one| Rc::ptr_eq(one, bytes));
        let bytes: usize = buffers.iter().enumerate().filter(is_new).map(|(_, bytes)| bytes.len()).sum();
        Self { buffers, left: Cell::new(MOST_SHARED * bytes + MOST_ZEROS), bytes }
    }

    /// How many bytes the buffers have.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Vectors of `N` numbers; integers are scaled where the accessor says that they are normalized.
    pub fn vectors<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        if accessor.dimensions().multiplicity() != N || matches!(accessor.dimensions(), Dimensions::Mat2) {
            return Err(format!("accessor {} has not the {N} numbers that are wanted", accessor.index()));
        }
        let number = number(accessor.data_type(), accessor.normalized());
        let size = accessor.data_type().size();
        let vector = |bytes: &[u8]| std::array::from_fn(|place| number(&bytes[place * size..]));
        self.elements(accessor, [0.0; N], vector)
    }

    /// Indices of vertices.
    pub fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, String> {
        let index: fn(&[u8]) -> u32 = match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Scalar, DataType::U8) => |bytes| bytes[0].into(),
            (Dimensions::Scalar, DataType::U16) => |bytes| u16::from_le_bytes([bytes[0], bytes[1]]).into(),
            (Dimensions::Scalar, DataType::U32) => word,
            _ => return Err(format!("accessor {} holds no indices", accessor.index())),
        };
        self.elements(accessor, 0, index)
    }

    fn elements<T: Copy>(&self, accessor: &Accessor<'_>, zero: T, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, String> {
        let (count, size) = (accessor.count(), accessor.size());
        let taken = count.checked_mul(size_of::<T>());
        let left = taken.and_then(|taken| self.left.get().checked_sub(taken)).ok_or_else(|| {
            format!("accessor {} has {count} elements: more than the buffers hold, or the same bytes are read again and again", accessor.index())
        })?;
        self.left.set(left);
        let mut elements = match accessor.view() {
            None => vec![zero; count],
            Some(view) => {
                let stride = view.stride().unwrap_or(size);
                let bytes = slice(&view, self.buffers)?;
                let chunks = strided(bytes, accessor.offset(), stride, size, count);
                chunks.ok_or_else(|| beyond(accessor))?.map(&read).collect()
            }
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let width = indices.index_type().size();
            let places = slice(&indices.view(), self.buffers)?;
            let places = strided(places, indices.offset(), width, width, sparse.count());
            let values_of = slice(&values.view(), self.buffers)?;
            let values = strided(values_of, values.offset(), size, size, sparse.count());
            let (places, values) = places.zip(values).ok_or_else(|| beyond(accessor))?;
            for (place, value) in places.zip(values) {
                let place = match indices.index_type() {
                    IndexType::U8 => place[0].into(),
                    IndexType::U16 => u16::from_le_bytes([place[0], place[1]]).into(),
                    IndexType::U32 => word(place),
                };
                *elements.get_mut(place as usize).ok_or_else(|| beyond(accessor))? = read(value);
            }
        }
        Ok(elements)
    }
}

fn beyond(accessor: &Accessor<'_>) -> String {
    format!("accessor {} reaches beyond its buffer view; the file is damaged", accessor.index())
}

/// `count` pieces of `size` bytes, `stride` apart, if they are there.
fn strided(
    bytes: &[u8],
    offset: usize,
    stride: usize,
    size: usize,
    count: usize,
) -> Option<impl Iterator<Item = &[u8]>> {
    if stride < size {
        return None;
    }
    let last = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))?;
    let bytes = bytes.get(offset..offset.checked_add(last)?)?;
    Some((0..count).map(move |element| &bytes[element * stride..][..size]))
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// What reads a number of that type.
fn number(kind: DataType, normalized: bool) -> fn(&[u8]) -> f32 {
    match (kind, normalized) {
        (DataType::F32, _) => |bytes| f32::from_bits(word(bytes)),
        (DataType::U32, _) => |bytes| word(bytes) as f32,
        (DataType::U8, false) => |bytes| bytes[0].into(),
        (DataType::U8, true) => |bytes| f32::from(bytes[0]) / 255.0,
        (DataType::I8, false) => |bytes| (bytes[0] as i8).into(),
        (DataType::I8, true) => |bytes| (f32::from(bytes[0] as i8) / 127.0).max(-1.0),
        (DataType::U16, false) => |bytes| u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        (DataType::U16, true) => |bytes| f32::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
        (DataType::I16, false) => |bytes| i16::from_le_bytes([bytes[0], bytes[1]]).into(),
        (DataType::I16, true) => |bytes| (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])) / 32767.0).max(-1.0),
    }
}
