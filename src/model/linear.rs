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

#[cfg(test)]
mod tests {
    use super::Linear;
    use burn::module::Param;
    use burn::tensor::{Device, Tensor};

    #[test]
    fn each_row_is_multiplied_wherever_it_stands() {
        let device = Device::flex();
        let weight = Tensor::<2>::from_data([[1.0_f32, 2.0, 0.0], [3.0, 4.0, 5.0]], &device);
        let bias = Tensor::<1>::from_data([10.0_f32, 20.0, 30.0], &device);
        let inputs = Tensor::<3>::from_data([[[1.0_f32, 0.0]], [[2.0, -1.0]]], &device);
        let layer = Linear::new(Param::from_tensor(weight), Some(Param::from_tensor(bias)));
        let outputs = layer.forward(inputs);
        assert_eq!(outputs.dims(), [2, 1, 3]);
        let values: Vec<f32> = outputs.into_data().try_into_vec().unwrap();
        assert_eq!(values, [11.0, 22.0, 30.0, 9.0, 20.0, 25.0]);
    }
}
