//! Convolutions over pictures whose channels lie last.
//!
//! ```text
//! rows of a picture ─► tile of patches ─► product with the weight ─► rows of the output
//! ```
//!
//! A tile fits a core's cache and is forgotten after its product; both gradients are products of such tiles too.
//! That is on the processor; elsewhere burn's own convolution does the same.
//!
//! # Shapes
//!
//! Pictures are `[F, height, width, channels]`, a weight is `[kernel * kernel * channels, outputs]`.
//!
//! # Invariants
//!
//! Tiles, and the order in which their gradients are added, follow from shapes alone: any number of threads gives the
//! same numbers.

mod products;
mod tiles;

use burn::backend::autodiff::NodeId;
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::module::{Module, Param};
use burn::tensor::module::conv2d;
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor};

use crate::model::convolution::products::{bias_gradient, convolve, input_gradient, weight_gradient};
use crate::model::convolution::tiles::Geometry;
use crate::model::device::is_processor;

/// A convolution with a square kernel.
#[derive(Module, Debug)]
pub(crate) struct Convolution {
    weight: Param<Tensor<2>>,
    bias: Param<Tensor<1>>,
    kernel: usize,
    stride: usize,
    padding: usize,
}

impl Convolution {
    pub(crate) fn new(weight: Param<Tensor<2>>, bias: Param<Tensor<1>>, [kernel, stride, padding]: [usize; 3]) -> Self {
        Self { weight, bias, kernel, stride, padding }
    }

    pub(crate) fn device(&self) -> Device {
        self.weight.device()
    }

    /// # Shapes
    ///
    /// `[F, height, width, channels]` → `[F, (height + 2 padding - kernel) / stride + 1, …, outputs]`
    pub(crate) fn forward(&self, pictures: Tensor<4>) -> Tensor<4> {
        let &Self { kernel, stride, padding, .. } = self;
        if !is_processor(&pictures.device()) {
            return self.forward_elsewhere(pictures);
        }
        let geometry = Geometry { pictures: pictures.dims(), kernel, stride, padding };
        let [weight, bias] = [self.weight.val().into_dispatch(), self.bias.val().into_dispatch()];
        Tensor::from_dispatch(<Dispatch as Convolve>::convolve(pictures.into_dispatch(), weight, bias, geometry))
    }
}

impl Convolution {
    /// By burn's own convolution, whose channels lie first. In which order they lie while it works is its own business.
    fn forward_elsewhere(&self, pictures: Tensor<4>) -> Tensor<4> {
        let &Self { kernel, stride, padding, .. } = self;
        let (n_inputs, n_outputs) = (pictures.dims()[3], self.bias.dims()[0]);
        let weight = self.weight.val().reshape([kernel, kernel, n_inputs, n_outputs]).permute([3, 2, 0, 1]);
        let options = ConvOptions::new([stride; 2], [padding; 2], [1; 2], 1);
        let output = conv2d(pictures.permute([0, 3, 1, 2]), weight, Some(self.bias.val()), options);
        output.permute([0, 2, 3, 1])
    }
}

/// What burn is taught.
#[backend_extension(Flex, Autodiff)]
pub(crate) trait Convolve: Backend {
    fn convolve(
        pictures: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        geometry: Geometry,
    ) -> FloatTensor<Self>;
}

impl Convolve for Flex {
    fn convolve(
        pictures: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        geometry: Geometry,
    ) -> FloatTensor<Self> {
        convolve(&pictures, &weight, &bias, geometry)
    }
}

impl<C: CheckpointStrategy> Convolve for Autodiff<Flex, C> {
    fn convolve(
        pictures: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        geometry: Geometry,
    ) -> FloatTensor<Self> {
        let nodes = [pictures.node(), weight.node(), bias.node()];
        let output = convolve(pictures.primitive(), weight.primitive(), bias.primitive(), geometry);
        match ConvolveBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(mut prepared) => {
                let state = [prepared.checkpoint(&pictures), prepared.checkpoint(&weight)];
                prepared.finish((state, geometry), output)
            }
            OpsKind::UnTracked(prepared) => prepared.finish(output),
        }
    }
}

#[derive(Debug)]
struct ConvolveBackward;

impl Backward<Flex, 3> for ConvolveBackward {
    type State = ([NodeId; 2], Geometry);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, checkpointer: &mut Checkpointer) {
        let gradient = grads.consume::<Flex>(&ops.node);
        let ([pictures, weight], geometry) = ops.state;
        let [pictures, weight] = [pictures, weight].map(|node| checkpointer.retrieve_node_output(node));
        let [to_pictures, to_weight, to_bias] = ops.parents;
        if let Some(node) = to_pictures {
            grads.register::<Flex>(node.id, input_gradient(&gradient, &weight, geometry));
        }
        if let Some(node) = to_weight {
            grads.register::<Flex>(node.id, weight_gradient(&gradient, &pictures, geometry));
        }
        if let Some(node) = to_bias {
            grads.register::<Flex>(node.id, bias_gradient(&gradient));
        }
    }
}

#[cfg(test)]
mod tests {
    use burn::module::Param;
    use burn::tensor::module::conv2d;
    use burn::tensor::ops::ConvOptions;
    use burn::tensor::{Device, Tensor, TensorData, Tolerance};

    use super::Convolution;

    fn wave<const D: usize>(shape: [usize; D], step: f32) -> Tensor<D> {
        let values: Vec<f32> = (0..shape.iter().product()).map(|at| (at as f32 * step).sin()).collect();
        Tensor::from_data(TensorData::new(values, shape), &Device::flex().autodiff())
    }

    /// Output and the gradients of pictures, weight and bias, all as burn's own convolution lays them out.
    type Passed = [TensorData; 4];

    fn ours(pictures: Tensor<4>, weight: Tensor<4>, bias: Tensor<1>, sizes: [usize; 3]) -> Passed {
        let [n_outputs, n_inputs, kernel, _] = weight.dims();
        let pictures = pictures.permute([0, 2, 3, 1]).require_grad();
        let weight = weight.permute([2, 3, 1, 0]).reshape([kernel * kernel * n_inputs, n_outputs]);
        let layer = Convolution::new(Param::from_tensor(weight), Param::from_tensor(bias), sizes);
        let output = layer.forward(pictures.clone());
        let grads = (output.clone() * wave(output.dims(), 0.3)).sum().backward();
        let of_weight = layer.weight.grad(&grads).expect("it has one");
        let of_weight = of_weight.reshape([kernel, kernel, n_inputs, n_outputs]).permute([3, 2, 0, 1]);
        [
            output.permute([0, 3, 1, 2]).into_data(),
            pictures.grad(&grads).expect("it has one").permute([0, 3, 1, 2]).into_data(),
            of_weight.into_data(),
            layer.bias.grad(&grads).expect("it has one").into_data(),
        ]
    }

    fn burns(pictures: Tensor<4>, weight: Tensor<4>, bias: Tensor<1>, [_, stride, padding]: [usize; 3]) -> Passed {
        let [pictures, weight] = [pictures, weight].map(Tensor::require_grad);
        let bias = bias.require_grad();
        let options = ConvOptions::new([stride; 2], [padding; 2], [1; 2], 1);
        let output = conv2d(pictures.clone(), weight.clone(), Some(bias.clone()), options);
        let [n, channels, height, width] = output.dims();
        let weights = wave([n, height, width, channels], 0.3).permute([0, 3, 1, 2]);
        let grads = (output.clone() * weights).sum().backward();
        [
            output.into_data(),
            pictures.grad(&grads).expect("it has one").into_data(),
            weight.grad(&grads).expect("it has one").into_data(),
            bias.grad(&grads).expect("it has one").into_data(),
        ]
    }

    #[test]
    fn output_and_gradients_are_those_of_burns_convolution() {
        // Pictures in several chunks, one in several tiles, kernels that leave it, strides that skip its border.
        for (pictures, n_outputs, sizes) in [
            ([5, 3, 7, 6], 4, [3, 1, 1]),
            ([3, 2, 8, 8], 3, [3, 2, 1]),
            ([2, 4, 9, 5], 2, [5, 2, 2]),
            ([70, 16, 4, 4], 5, [4, 1, 0]),
            ([9, 12, 64, 64], 2, [3, 1, 1]),
            ([1, 3, 5, 5], 2, [1, 3, 0]),
        ] {
            let weight = wave([n_outputs, pictures[1], sizes[0], sizes[0]], 0.7);
            let case = || (wave(pictures, 0.11), weight.clone(), wave([n_outputs], 1.3));
            let ((p, w, b), (q, v, c)) = (case(), case());
            for (ours, burns) in ours(p, w, b, sizes).into_iter().zip(burns(q, v, c, sizes)) {
                ours.assert_approx_eq::<f32>(&burns, Tolerance::rel_abs(1e-3, 2e-3));
            }
        }
    }

    #[test]
    fn it_is_the_same_by_burns_own_as_accelerators_compute_it() {
        let (weight, bias) = (wave([3 * 3 * 4, 5], 0.7), wave([5], 1.3));
        let layer = Convolution::new(Param::from_tensor(weight), Param::from_tensor(bias), [3, 2, 1]);
        let pictures: Tensor<4> = wave([6, 9, 7, 4], 0.11);
        let [own, burns] = [layer.forward(pictures.clone()), layer.forward_elsewhere(pictures)];
        assert_eq!((own.dims(), burns.dims()), ([6, 5, 4, 5], [6, 5, 4, 5]));
        own.into_data().assert_approx_eq::<f32>(&burns.into_data(), Tolerance::rel_abs(1e-5, 1e-5));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let pass = || ours(wave([40, 3, 32, 32], 0.11), wave([8, 3, 3, 3], 0.7), wave([8], 1.3), [3, 1, 1]);
        let with = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads");
            pool.install(pass)
        };
        assert_eq!(with(1), with(5));
    }

    #[test]
    fn a_patch_beyond_the_border_reads_zeros() {
        let ones = |shape| Tensor::<4>::ones(shape, &Device::flex().autodiff());
        let [output, ..] = ours(ones([1, 1, 3, 3]), ones([1, 1, 3, 3]), wave([1], 0.0), [3, 2, 1]);
        assert_eq!(output.try_to_vec::<f32>().expect("floats"), [4.0; 4]);
    }
}
