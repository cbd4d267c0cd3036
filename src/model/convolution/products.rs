//! The products of patches with weights, and their gradients.

use std::ops::Range;

use burn::backend::Flex;
use burn::backend::flex::FlexTensor;
use burn::backend::ops::FloatTensorOps as _;
use burn::tensor::TensorData;
use rayon::prelude::*;

use crate::model::convolution::tiles::Geometry;

/// Sums of weights' gradients that are kept apart until the end, so that as many threads can add.
const N_SUMS: usize = 8;

/// See [`super::Convolution::forward`].
pub(super) fn convolve(
    pictures: &FlexTensor,
    weight: &FlexTensor,
    bias: &FlexTensor,
    geometry: Geometry,
) -> FlexTensor {
    let (pictures, bias) = (pictures.to_contiguous(), bias.to_contiguous());
    let (pictures, bias) = (values(&pictures), values(&bias));
    let ([n_rows, n_columns], n_outputs) = (geometry.outputs(), bias.len());
    let mut output = vec![0.0; geometry.n_pictures() * n_rows * n_columns * n_outputs];
    pictures
        .par_chunks((geometry.chunk() * geometry.picture_len()).max(1))
        .zip(output.par_chunks_mut((geometry.chunk() * n_rows * n_columns * n_outputs).max(1)))
        .for_each(|(pictures, output)| {
            each_tile(geometry, pictures, |rows, patches| {
                let products = Flex::float_matmul(patches, weight.clone());
                let output = &mut output[rows.start * n_columns * n_outputs..rows.end * n_columns * n_outputs];
                let pairs = output.chunks_exact_mut(n_outputs).zip(values(&products).chunks_exact(n_outputs));
                pairs.for_each(|(output, product)| {
                    let sums = product.iter().zip(bias).map(|(product, bias)| product + bias);
                    output.iter_mut().zip(sums).for_each(|(output, sum)| *output = sum);
                });
            });
        });
    tensor(output, [geometry.n_pictures(), n_rows, n_columns, n_outputs])
}

/// Of the pictures: each patch's is the product of its output's with the weight.
pub(super) fn input_gradient(gradient: &FlexTensor, weight: &FlexTensor, geometry: Geometry) -> FlexTensor {
    let [_, n_columns] = geometry.outputs();
    let (gradient, weight) = (rows_of(gradient), weight.transpose(0, 1));
    let mut pictures = vec![0.0; geometry.n_pictures() * geometry.picture_len()];
    pictures.par_chunks_mut((geometry.chunk() * geometry.picture_len()).max(1)).enumerate().for_each(
        |(chunk, pictures)| {
            let first = chunk * geometry.chunk() * geometry.outputs()[0];
            for rows in geometry.tiles(pictures.len() / geometry.picture_len()) {
                let gradient = gradient.narrow(0, (first + rows.start) * n_columns, rows.len() * n_columns);
                let patches = Flex::float_matmul(gradient, weight.clone());
                geometry.scatter(values(&patches), rows, pictures);
            }
        },
    );
    tensor(pictures, geometry.pictures)
}

/// Of the weight: patches times their outputs' gradients, added up.
pub(super) fn weight_gradient(gradient: &FlexTensor, pictures: &FlexTensor, geometry: Geometry) -> FlexTensor {
    let [n_rows, n_columns] = geometry.outputs();
    let (gradient, pictures) = (rows_of(gradient), pictures.to_contiguous());
    let chunks: Vec<&[f32]> = values(&pictures).chunks((geometry.chunk() * geometry.picture_len()).max(1)).collect();
    let sum_of_chunks = |nth: usize| {
        let mut sum = None;
        for (chunk, pictures) in chunks.iter().enumerate().skip(nth).step_by(N_SUMS) {
            each_tile(geometry, pictures, |rows, patches| {
                let first = (chunk * geometry.chunk() * n_rows + rows.start) * n_columns;
                let gradient = gradient.narrow(0, first, rows.len() * n_columns);
                add(&mut sum, Flex::float_matmul(patches.transpose(0, 1), gradient));
            });
        }
        sum
    };
    let sums: Vec<Option<FlexTensor>> = (0..N_SUMS).into_par_iter().map(sum_of_chunks).collect();
    let mut total = None;
    sums.into_iter().flatten().for_each(|sum| add(&mut total, sum));
    total.unwrap_or_else(|| {
        tensor(vec![0.0; geometry.patch_len() * width(&gradient)], [geometry.patch_len(), width(&gradient)])
    })
}

/// Of the bias: the outputs' gradients, added up.
pub(super) fn bias_gradient(gradient: &FlexTensor) -> FlexTensor {
    let gradient = rows_of(gradient);
    let n_outputs = width(&gradient);
    Flex::float_sum_dim(gradient, 0).reshape([n_outputs].into())
}

/// Gathers the patches of pictures portion by portion, `[rows * columns, patch]` each.
fn each_tile(geometry: Geometry, pictures: &[f32], mut each: impl FnMut(Range<usize>, FlexTensor)) {
    let [_, n_columns] = geometry.outputs();
    let mut buffer: Option<FlexTensor> = None;
    for rows in geometry.tiles(pictures.len() / geometry.picture_len()) {
        let n_patches = rows.len() * n_columns;
        let n_numbers = n_patches * geometry.patch_len();
        // The first portion is the largest. Nobody else holds the buffer any more: it is written in place.
        let buffer = buffer.get_or_insert_with(|| tensor(vec![0.0; n_numbers], [n_patches, geometry.patch_len()]));
        geometry.gather(pictures, rows.clone(), &mut buffer.storage_mut()[..n_numbers]);
        each(rows, buffer.narrow(0, 0, n_patches));
    }
}

fn add(sum: &mut Option<FlexTensor>, part: FlexTensor) {
    *sum = Some(match sum.take() {
        Some(sum) => Flex::float_add(sum, part),
        None => part,
    });
}

/// `[F, height, width, outputs]` → `[F * height * width, outputs]`
fn rows_of(gradient: &FlexTensor) -> FlexTensor {
    let gradient = gradient.to_contiguous();
    let shape = gradient.layout().shape();
    let (n_outputs, n_rows) = (shape[3], shape[0] * shape[1] * shape[2]);
    gradient.reshape([n_rows, n_outputs].into())
}

fn width(matrix: &FlexTensor) -> usize {
    matrix.layout().shape()[1]
}

fn values(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().expect("floats that lie side by side")
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, shape))
}
