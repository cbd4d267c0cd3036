//! One feature of a dataset that is being written.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{
    Array as _, ArrayRef, BinaryArray, BooleanArray, FixedSizeListArray, Float32Array, Float64Array, Int64Array,
    StringArray, StructArray,
};
use arrow::datatypes::{DataType, Field, Fields};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

use crate::dataset::files::info::{CameraInfo, Dtype, FeatureInfo};
use crate::dataset::pictures::PictureStatistics;
use crate::dataset::plain::feature::{Cell, PlainError, PlainFeature, PlainKind};
use crate::dataset::plain::meta::MetaRow;
use crate::dataset::plain::picture::{Picture, PictureSample};
use crate::dataset::plain::video::VideoTrack;
use crate::table::Values;

/// A feature, and what it holds of the episode that is being written.
pub(super) struct PlainColumn {
    feature: PlainFeature,
    fps: u32,
    values: Held,
}

/// Numbers and texts of the whole episode, and pictures that are not yet written.
enum Held {
    Float32(Vec<f32>),
    Float64(Vec<f64>),
    Int64(Vec<i64>),
    Bool(Vec<bool>),
    Text(Vec<String>),
    Images(Vec<Picture>, Box<PictureSample>),
    Video(Box<VideoTrack>),
}

impl PlainColumn {
    pub(super) fn new(root: &Path, feature: &PlainFeature, fps: u32, file_bytes: usize) -> Self {
        let values = match &feature.kind {
            PlainKind::Numbers(Dtype::Float64, _) => Held::Float64(Vec::new()),
            PlainKind::Numbers(Dtype::Int64, _) => Held::Int64(Vec::new()),
            PlainKind::Numbers(Dtype::Bool, _) => Held::Bool(Vec::new()),
            PlainKind::Numbers(..) => Held::Float32(Vec::new()),
            PlainKind::Text => Held::Text(Vec::new()),
            PlainKind::Image(size_px) => Held::Images(Vec::new(), Box::new(PictureSample::new(*size_px))),
            PlainKind::Video(size_px) => {
                Held::Video(Box::new(VideoTrack::new(root, &feature.name, *size_px, fps, file_bytes)))
            }
        };
        Self { feature: feature.clone(), fps, values }
    }

    /// Adds a cell of the kind that the feature has; `number` is the frame's in its episode.
    pub(super) fn push(&mut self, cell: Cell, number: u64) -> Result<(), PlainError> {
        let name = &self.feature.name;
        let failed = |source| PlainError::Picture { feature: name.clone(), source };
        match (&mut self.values, cell) {
            (Held::Float32(values), Cell::Numbers(numbers)) => values.extend(numbers.iter().map(|&value| value as f32)),
            (Held::Float64(values), Cell::Numbers(numbers)) => values.extend(numbers),
            (Held::Int64(values), Cell::Numbers(numbers)) => values.extend(numbers.iter().map(|&value| value as i64)),
            (Held::Bool(values), Cell::Numbers(numbers)) => values.extend(numbers.iter().map(|&value| value != 0.0)),
            (Held::Text(values), Cell::Text(text)) => values.push(text),
            (Held::Images(values, sample), Cell::Image(picture)) => {
                sample.look(&picture).map_err(failed)?;
                values.push(picture);
            }
            (Held::Video(track), Cell::Video(packets)) => track.push(packets, number).map_err(failed)?,
            _ => debug_assert!(false, "{name} is given a cell of another kind"),
        }
        Ok(())
    }

    pub(super) fn n_picture_bytes(&self) -> usize {
        match &self.values {
            Held::Images(pictures, _) => pictures.iter().map(Picture::n_bytes).sum(),
            _ => 0,
        }
    }

    /// The numbers of the episode.
    pub(super) fn values(&self) -> Option<(&str, Values<'_>)> {
        let PlainKind::Numbers(_, names) = &self.feature.kind else { return None };
        let values = match (&self.values, names.len()) {
            (Held::Float32(values), 1) => Values::Float32(values),
            (Held::Float32(values), width) => Values::Float32Vector(values, width),
            (Held::Float64(values), 1) => Values::Float64(values),
            (Held::Float64(values), width) => Values::Float64Vector(values, width),
            (Held::Int64(values), 1) => Values::Int64(values),
            (Held::Int64(values), width) => Values::Int64Vector(values, width),
            (Held::Bool(values), _) => Values::Boolean(values),
            _ => return None,
        };
        Some((&self.feature.name, values))
    }

    /// Rows of the episode as a column of the table; none of a video. Pictures are held no longer.
    pub(super) fn array(&mut self, rows: &Range<usize>) -> Result<Option<(Field, ArrayRef)>, PlainError> {
        let (name, width) = (self.feature.name.clone(), self.width());
        let numbers = rows.start * width..rows.end * width;
        let array: ArrayRef = match &mut self.values {
            Held::Float32(values) => listed(Arc::new(Float32Array::from(values[numbers].to_vec())), width),
            Held::Float64(values) => listed(Arc::new(Float64Array::from(values[numbers].to_vec())), width),
            Held::Int64(values) => listed(Arc::new(Int64Array::from(values[numbers].to_vec())), width),
            Held::Bool(values) => listed(Arc::new(BooleanArray::from(values[numbers].to_vec())), width),
            Held::Text(values) => Arc::new(StringArray::from_iter_values(&values[rows.clone()])),
            Held::Images(pictures, _) => {
                let encoded: Result<Vec<Vec<u8>>, _> = pictures.par_iter().map(Picture::encoded).collect();
                pictures.clear();
                let encoded = encoded.map_err(|source| PlainError::Picture { feature: name.clone(), source })?;
                image_array(&encoded)
            }
            Held::Video(_) => return Ok(None),
        };
        let field = Field::new(name, array.data_type().clone(), false);
        Ok(Some((field, array)))
    }

    fn width(&self) -> usize {
        match &self.feature.kind {
            PlainKind::Numbers(_, names) => names.len(),
            _ => 1,
        }
    }

    /// Forgets the episode, whose videos `row` is told of.
    pub(super) fn end_episode(&mut self, row: &mut MetaRow) -> Result<(), PlainError> {
        match &mut self.values {
            Held::Float32(values) => values.clear(),
            Held::Float64(values) => values.clear(),
            Held::Int64(values) => values.clear(),
            Held::Bool(values) => values.clear(),
            Held::Text(values) => values.clear(),
            Held::Images(..) => {}
            Held::Video(track) => {
                let feature = self.feature.name.clone();
                let place = track.end_episode();
                let place = place.map_err(|source| PlainError::Picture { feature: feature.clone(), source })?;
                row.videos.push((feature, place));
            }
        }
        Ok(())
    }

    /// Ends the files; gives the statistics of pictures.
    pub(super) fn finish(self) -> Result<Option<(String, PictureStatistics)>, PlainError> {
        let name = self.feature.name;
        let statistics = match self.values {
            Held::Images(_, sample) => Some(sample.statistics()),
            Held::Video(track) => {
                let finished = track.finish();
                Some(finished.map_err(|source| PlainError::Picture { feature: name.clone(), source })?)
            }
            _ => None,
        };
        Ok(statistics.map(|statistics| (name, statistics)))
    }

    /// As `meta/info.json` declares it.
    pub(super) fn declared(&self) -> (String, FeatureInfo) {
        let of_picture = |[width, height]: [u32; 2], dtype, info| {
            let names = ["height", "width", "channels"].map(ToOwned::to_owned).into();
            FeatureInfo { dtype, shape: vec![height as usize, width as usize, 3], names: Some(names), info }
        };
        let info = match &self.feature.kind {
            PlainKind::Numbers(dtype, names) => {
                let (shape, names) = (vec![names.len()], Some(names.clone()));
                FeatureInfo { dtype: *dtype, shape, names, info: None }
            }
            PlainKind::Text => FeatureInfo { dtype: Dtype::String, shape: vec![1], names: None, info: None },
            PlainKind::Image(size_px) => of_picture(*size_px, Dtype::Image, None),
            PlainKind::Video(size_px) => {
                of_picture(*size_px, Dtype::Video, Some(CameraInfo::h264(*size_px, f64::from(self.fps))))
            }
        };
        (self.feature.name.clone(), info)
    }
}

/// Several numbers a row are lists of a fixed length.
fn listed(values: ArrayRef, width: usize) -> ArrayRef {
    if width == 1 {
        return values;
    }
    let field = Arc::new(Field::new("element", values.data_type().clone(), false));
    Arc::new(FixedSizeListArray::new(field, width as i32, values, None))
}

/// `LeRobot`'s struct of bytes and path.
fn image_array(encoded: &[Vec<u8>]) -> ArrayRef {
    let bytes = BinaryArray::from_iter_values(encoded);
    let paths = StringArray::new_null(encoded.len());
    let fields = [Field::new("bytes", DataType::Binary, true), Field::new("path", DataType::Utf8, true)]
        .into_iter()
        .collect::<Fields>();
    Arc::new(StructArray::new(fields, vec![Arc::new(bytes), Arc::new(paths)], None))
}
