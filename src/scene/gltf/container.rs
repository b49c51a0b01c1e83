//! What glTF files are made of: JSON, and buffers beside it, in it or behind it. In flow bytes and URIs, out flow bytes.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::buffer;
use percent_encoding::percent_decode_str;

use crate::scene::files::Files;
use crate::scene::mesh_file::ImageSource;
use crate::{Error, Result};

/// The JSON of a file, and the binary chunk that a GLB has behind it.
pub struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// The parts of a file that is a GLB or JSON; the error says what is wrong.
    pub fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let Some(rest) = bytes.strip_prefix(b"glTF") else {
            // Some programs begin text with a mark of its encoding.
            return Ok(Self { json: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), binary: None });
        };
        let (version, rest) = word(rest)?;
        if version != 2 {
            return Err(format!("is glTF of version {version}; only 2 is read, convert it"));
        }
        let (length, rest) = word(rest)?;
        let whole = (length as usize).checked_sub(12).and_then(|length| rest.get(..length));
        let mut rest = whole.ok_or_else(|| format!("says that it has {length} bytes and has {}", bytes.len()))?;
        let (mut json, mut binary) = (None, None);
        while !rest.is_empty() {
            let (length, after) = word(rest)?;
            let (kind, after) = after.split_at_checked(4).ok_or(CUT)?;
            let (chunk, after) = after.split_at_checked(length as usize).ok_or(CUT)?;
            match kind {
                b"JSON" if json.is_none() => json = Some(chunk),
                b"BIN\0" if binary.is_none() => binary = Some(chunk),
                _ => {}
            }
            rest = after;
        }
        Ok(Self { json: json.ok_or("has no JSON in it")?, binary })
    }
}

/// What is said of a file that ends too early.
const CUT: &str = "ends in the middle of a chunk; it was cut off";

fn word(bytes: &[u8]) -> Result<(u32, &[u8]), String> {
    let (word, rest) = bytes.split_first_chunk().ok_or(CUT)?;
    Ok((u32::from_le_bytes(*word), rest))
}

/// The bytes of a buffer, which may be those of another.
pub type Bytes<'a> = Rc<Cow<'a, [u8]>>;

/// Where bytes come from that a file names.
pub struct Resources<'a> {
    pub files: Files,
    pub path: &'a Path,
    /// The files that were read.
    pub read: Vec<PathBuf>,
}

impl Resources<'_> {
    /// The bytes of each buffer, at least as many as it says.
    pub fn buffers<'a>(&mut self, document: &gltf::Document, binary: Option<&'a [u8]>) -> Result<Vec<Bytes<'a>>> {
        let mut all: Vec<Bytes<'_>> = Vec::new();
        let mut of_files: HashMap<PathBuf, Bytes<'_>> = HashMap::new();
        for buffer in document.buffers() {
            let number = buffer.index();
            let bytes = match buffer.source() {
                buffer::Source::Bin => match binary.filter(|_| number == 0) {
                    Some(bytes) => Rc::new(Cow::Borrowed(bytes)),
                    None => return Err(self.wrong(format!("buffer {number} has no data; export the model again"))),
                },
                buffer::Source::Uri(uri) => match data_uri(uri) {
                    Some(bytes) => {
                        let bytes = bytes.map_err(|why| self.wrong(format!("buffer {number}: its data URI {why}")))?;
                        Rc::new(Cow::Owned(bytes))
                    }
                    None => {
                        let path = self.beside(uri).map_err(|why| self.wrong(format!("buffer {number}: {why}")))?;
                        match of_files.get(&path) {
                            Some(bytes) => bytes.clone(),
                            None => {
                                let read = self.files.read(&path);
                                let bytes =
                                    read.map_err(|error| self.wrong(format!("buffer {number}: {}", error.in_full())))?;
                                let bytes = Rc::new(bytes);
                                of_files.insert(path.clone(), bytes.clone());
                                self.read.push(path);
                                bytes
                            }
                        }
                    }
                },
            };
            let (wanted, found) = (buffer.length(), bytes.len());
            if found < wanted {
                let message = format!("buffer {number} has {found} bytes, not {wanted}; it was cut off");
                return Err(self.wrong(message));
            }
            all.push(bytes);
        }
        Ok(all)
    }

    /// Where the bytes of the image `number` are; the error says why there are none.
    pub fn image(
        &self,
        document: &gltf::Document,
        number: usize,
        buffers: &[Bytes<'_>],
    ) -> Result<ImageSource, String> {
        let embedded = |bytes: &[u8]| {
            let name = PathBuf::from(format!("{}#image{number}", self.path.display()));
            ImageSource::Embedded { name, bytes: Arc::from(bytes) }
        };
        // As JSON has it: the crate wants to know its kind, which its bytes tell.
        let image = document.as_json().images.get(number).ok_or("it does not exist")?;
        match (&image.buffer_view, &image.uri) {
            (Some(view), _) => {
                let view = document.views().nth(view.value()).ok_or("its buffer view does not exist")?;
                slice(&view, buffers).map(embedded)
            }
            (None, Some(uri)) => match data_uri(uri) {
                Some(bytes) => bytes.map(|bytes| embedded(&bytes)),
                None => self.beside(uri).map(ImageSource::File),
            },
            (None, None) => Err("it has neither bytes nor a file".into()),
        }
    }

    /// The file that a relative URI names.
    fn beside(&self, uri: &str) -> Result<PathBuf, String> {
        if let Some((scheme, _)) = uri.split_once("://") {
            return Err(format!("{uri:?}: {scheme} is not read, save the file beside this one"));
        }
        if uri.is_empty() {
            return Err("its URI is empty; export the model again".into());
        }
        let name = percent_decode_str(uri).decode_utf8_lossy();
        Ok(self.path.parent().unwrap_or(Path::new("")).join(&*name))
    }

    fn wrong(&self, message: String) -> Error {
        Error::input(self.path, 0, message)
    }
}

/// The bytes of a buffer view.
pub fn slice<'a>(view: &buffer::View<'_>, buffers: &'a [Bytes<'_>]) -> Result<&'a [u8], String> {
    let whole = buffers.get(view.buffer().index());
    let end = view.offset().checked_add(view.length());
    whole
        .zip(end)
        .and_then(|(bytes, end)| bytes.get(view.offset()..end))
        .ok_or_else(|| format!("buffer view {} reaches beyond its buffer; the file is damaged", view.index()))
}

/// The bytes in a data URI, if it is one.
fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let rest = uri.strip_prefix("data:")?;
    let Some((header, data)) = rest.split_once(',') else { return Some(Err("has no comma".into())) };
    Some(match header.ends_with(";base64") {
        true => STANDARD.decode(data.trim()).map_err(|error| format!("is no base 64: {error}")),
        false => Ok(percent_decode_str(data).collect()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let length: usize = 12 + chunks.iter().map(|(_, bytes)| 8 + bytes.len()).sum::<usize>();
        let mut all = b"glTF".to_vec();
        all.extend([2, length as u32].iter().flat_map(|word| word.to_le_bytes()));
        for (kind, bytes) in chunks {
            all.extend((bytes.len() as u32).to_le_bytes());
            all.extend(*kind);
            all.extend(*bytes);
        }
        all
    }

    #[test]
    fn the_chunks_of_a_binary_file_are_found() {
        let whole = glb(&[(b"JSON", b"{}  "), (b"BIN\0", &[1, 2, 3, 4]), (b"MINE", &[])]);
        let Container { json, binary } = Container::new(&whole).unwrap();
        assert_eq!((json, binary), (&b"{}  "[..], Some(&[1, 2, 3, 4][..])));
        assert_eq!(Container::new(b"{}").unwrap().json, b"{}");
        // Wherever it is cut, that is said.
        for end in 4..whole.len() {
            assert!(Container::new(&whole[..end]).is_err(), "{end}");
        }
        let mut old = whole;
        old[4] = 1;
        assert!(Container::new(&old).err().unwrap().contains("version 1"));
        assert!(Container::new(&glb(&[(b"BIN\0", &[0; 4])])).err().unwrap().contains("no JSON"));
    }

    #[test]
    fn data_uris_hold_their_bytes() {
        assert_eq!(data_uri("data:application/octet-stream;base64,AAEC").unwrap().unwrap(), [0, 1, 2]);
        assert_eq!(data_uri("data:,a%20b").unwrap().unwrap(), b"a b");
        assert!(data_uri("data:;base64,!").unwrap().unwrap_err().contains("base 64"));
        assert!(data_uri("ball.bin").is_none());
    }
}
