//! A linear layer, one product for all rows.
//!
//! burn's own takes a product for each entry of the leading dimensions wherever it thinks that those fill its tiles, and
//! then the gradient of the weight is made once for each entry and added up: hundreds of megabytes where one weight's
//! gradient is asked for. One product of all rows is as fast forwards and several times as fast backwards.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor};

/// `outputs = inputs · weight + bias`
#[derive(Module, Debug)]
pub struct Linear {
    /// `[n_inputs, n_outputs]`
    weight: Param<Tensor<2>>,
    /// `[n_outputs]`
    bias: Option<Param<Tensor<1>>>,
}

impl Linear {
    /// One of these parameters.
    pub fn new(weight: Param<Tensor<2>>, bias: Option<Param<Tensor<1>>>) -> Self {
        Self { weight, bias }
    }

    pub(crate) fn device(&self) -> Device {
        self.weight.device()
    }

    pub(crate) fn n_inputs(&self) -> usize {
        self.weight.dims()[0]
    }

    pub(crate) fn n_outputs(&self) -> usize {
        self.weight.dims()[1]
    }

    /// # Shapes
    ///
    /// `[..., n_inputs]` → `[..., n_outputs]`
    pub fn forward<const D: usize>(&self, inputs: Tensor<D>) -> Tensor<D> {
        let mut shape = inputs.dims();
        let n_inputs = shape[D - 1];
        let n_rows = shape[..D - 1].iter().product();
        shape[D - 1] = self.n_outputs();
        let rows: Tensor<2> = inputs.reshape([n_rows, n_inputs]);
        let products = rows.matmul(self.weight.val());
        let outputs = match &self.bias {
            Some(bias) => products + bias.val().unsqueeze::<2>(),
            None => products,
        };
        outputs.reshape(shape)
    }
}
