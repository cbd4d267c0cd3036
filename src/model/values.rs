//! Numbers out of tensors. There is no other way out: a read that fails is an error and never an empty list, after
//! which something would be decided by default.

use burn::tensor::Tensor;

/// A tensor whose numbers could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a tensor of shape {shape:?} cannot be read as 32-bit floating-point numbers: {problem}")]
pub struct TensorError {
    shape: Vec<usize>,
    problem: String,
}

/// All numbers of a tensor, the last dimension fastest.
///
/// # Errors
///
/// [`TensorError`] when they cannot be computed, or are of another type.
pub fn values<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, TensorError> {
    let shape = tensor.dims().to_vec();
    let refuse = |problem: String| TensorError { shape: shape.clone(), problem };
    let data = tensor.try_into_data().map_err(|error| refuse(error.to_string()))?;
    data.try_into_vec().map_err(|error| refuse(error.to_string()))
}

/// The number of a tensor that has one.
///
/// # Errors
///
/// As [`values`], and when there is none.
pub fn scalar<const D: usize>(tensor: Tensor<D>) -> Result<f32, TensorError> {
    let none = TensorError { shape: tensor.dims().to_vec(), problem: "it has no number".to_owned() };
    values(tensor)?.first().copied().ok_or(none)
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, FloatDType, Tensor};

    use super::{scalar, values};

    #[test]
    fn numbers_of_another_type_are_an_error_and_no_empty_list() {
        let tensor = Tensor::<2>::from_data([[1.0_f32, 2.0]], &Device::flex());
        assert_eq!(values(tensor.clone()).unwrap(), [1.0, 2.0]);
        let error = values(tensor.cast(FloatDType::F64)).unwrap_err().to_string();
        assert!(
            error.starts_with("a tensor of shape [1, 2] cannot be read as 32-bit floating-point numbers"),
            "{error}"
        );
    }

    #[test]
    fn a_tensor_without_a_number_is_an_error() {
        assert_eq!(scalar(Tensor::<1>::from_data([3.0_f32], &Device::flex())), Ok(3.0));
        assert!(scalar(Tensor::<1>::zeros([0], &Device::flex())).is_err());
    }
}
