//! References: EXR files that say what they were made with. In flow a picture or bytes, out flow bytes or a [`Reference`].

use std::path::Path;

use super::suite::SCHEMA;
use crate::image::{FloatImage, Layer, decode_whole_exr, encode_exr};
use crate::options::Aov;
use crate::scene::Files;
use crate::{Error, Result};

/// The texts in the header that tell a reference from other images.
const SCHEMA_KEY: &str = "vitrum:reference";
const BATCHES_KEY: &str = "vitrum:batches";
const OPTIONS_KEY: &str = "vitrum:options";

/// What a picture was and is to be.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Radiance.
    pub image: FloatImage,
    /// The standard error of each pixel and how many batches it is from, of pictures that are sampled at random.
    pub stderr: Option<(Vec<[f32; 3]>, u32)>,
    /// The options it was made with.
    pub options: String,
    /// All texts in its header.
    pub provenance: Vec<(String, String)>,
}

impl Reference {
    /// The one at `path`; `Err` says why it cannot be used.
    pub fn read(path: &Path) -> Result<Self> {
        let unusable = |message: String| Error::input(path, 0, format!("{message}; make it again with --bless"));
        let bytes = Files::Disk.read(path)?;
        let (image, provenance) =
            decode_whole_exr(&bytes).map_err(|error| unusable(format!("is no reference: {}", error.0)))?;
        let text = |key: &str| provenance.iter().find(|(known, _)| known == key).map(|(_, text)| text.as_str());
        match text(SCHEMA_KEY) {
            None => return Err(unusable("does not say that it is a reference".into())),
            Some(schema) if schema != SCHEMA.to_string() => {
                return Err(unusable(format!("is of schema {schema}, this program reads {SCHEMA}")));
            }
            Some(_) => {}
        }
        let options = text(OPTIONS_KEY).unwrap_or_default().to_owned();
        let batches = text(BATCHES_KEY).and_then(|text| text.parse().ok());
        let stderr = image.layers.iter().find(|layer| layer.name == Aov::Stderr.name()).and_then(pixels);
        let stderr = stderr.zip(batches);
        Ok(Self { image, stderr, options, provenance })
    }

    /// The file.
    pub fn encode(&self) -> std::io::Result<Vec<u8>> {
        let mut texts = self.provenance.clone();
        texts.push((SCHEMA_KEY.into(), SCHEMA.to_string()));
        let mut image = self.image.clone();
        if let Some((stderr, batches)) = &self.stderr {
            texts.push((BATCHES_KEY.into(), batches.to_string()));
            let channel = |(index, name): (usize, &str)| {
                (name.to_owned(), stderr.iter().map(|pixel| pixel[index]).collect::<Vec<f32>>())
            };
            let channels = ["R", "G", "B"].into_iter().enumerate().map(channel).collect();
            image.layers = vec![Layer { name: Aov::Stderr.name().into(), channels }];
        }
        encode_exr(&image, &texts)
    }
}

/// Red, green and blue of a layer.
fn pixels(layer: &Layer) -> Option<Vec<[f32; 3]>> {
    let channel = |name: &str| layer.channels.iter().find(|(known, _)| known == name).map(|(_, values)| values);
    let (red, green, blue) = (channel("R")?, channel("G")?, channel("B")?);
    Some(red.iter().zip(green).zip(blue).map(|((&red, &green), &blue)| [red, green, blue]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> Reference {
        let image = FloatImage { width: 2, height: 1, pixels: vec![[0.1, 0.2, 0.3], [4.0; 3]], layers: Vec::new() };
        let stderr = Some((vec![[0.01; 3], [0.02, 0.03, 0.04]], 16));
        let provenance = vec![(OPTIONS_KEY.to_owned(), "--model=path".to_owned())];
        Reference { image, stderr, options: "--model=path".into(), provenance }
    }

    #[test]
    fn what_is_written_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        std::fs::write(&path, reference().encode().unwrap()).unwrap();
        let back = Reference::read(&path).unwrap();
        assert_eq!((back.image.pixels, back.stderr), (reference().image.pixels, reference().stderr));
        assert_eq!(back.options, "--model=path");
    }

    #[test]
    fn what_is_no_reference_of_this_kind_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let refusal = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            Reference::read(&path).unwrap_err().to_string()
        };
        let plain = |schema: &str| {
            let texts = [(SCHEMA_KEY.to_owned(), schema.to_owned())];
            encode_exr(&reference().image, if schema.is_empty() { &[] } else { &texts }).unwrap()
        };
        assert!(refusal(b"nothing").contains("is no reference"), "{}", refusal(b"nothing"));
        assert!(refusal(&plain("")).contains("does not say that it is a reference"));
        let error = refusal(&plain("7"));
        assert!(error.contains("is of schema 7, this program reads 1; make it again with --bless"), "{error}");
        let whole = reference().encode().unwrap();
        assert!(refusal(&whole[..whole.len() / 2]).contains("is no reference"));
    }
}
