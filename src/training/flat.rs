//! The parameters of a module as one vector, and their gradients: what an optimizer works on.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::{TensorError, values};

/// The gradient of a loss in the order of the module's parameters, on the processor.
pub(super) fn host_gradient<M: Module>(module: &M, total: Option<Tensor<1>>) -> Result<Vec<f32>, TensorError> {
    let gradients = total.map(|total| GradientsParams::from_grads(total.backward(), module)).unwrap_or_default();
    let mut flat = Flattener { gradients: &gradients, flat: Ok(Vec::new()) };
    module.visit(&mut flat);
    flat.flat
}

/// The parameters on the processor, one after another.
pub(super) fn host_parameters<M: Module>(module: &M) -> Result<Vec<f32>, TensorError> {
    let mut parts = Parameters(Vec::new());
    module.visit(&mut parts);
    let read: Vec<Vec<f32>> = parts.0.into_iter().map(values).collect::<Result<_, _>>()?;
    Ok(read.concat())
}

/// The module with other parameters, from the processor.
pub(super) fn with_host_parameters<M: Module>(module: M, values: &[f32]) -> M {
    module.map(&mut FromHost { values })
}

/// The gradient of a loss in the order of the module's parameters, where they are.
pub(super) fn gradient<M: Module>(module: &M, total: &Tensor<1>, device: Device) -> Tensor<1> {
    let gradients = GradientsParams::from_grads(total.backward(), module);
    let mut parts = Gradients { gradients: &gradients, device, flat: vec![] };
    module.visit(&mut parts);
    Tensor::cat(parts.flat, 0)
}

/// The parameters where they are, one after another.
pub(super) fn parameters<M: Module>(module: &M) -> Tensor<1> {
    let mut parts = Parameters(Vec::new());
    module.visit(&mut parts);
    Tensor::cat(parts.0, 0)
}

/// The module with other parameters, from where they are.
pub(super) fn with_parameters<M: Module>(module: M, flat: Tensor<1>) -> M {
    module.map(&mut FromFlat { flat, begin: 0 })
}

/// Gradients as one list; zeros for parameters that took no part.
struct Flattener<'g> {
    gradients: &'g GradientsParams,
    flat: Result<Vec<f32>, TensorError>,
}

impl ModuleVisitor for Flattener<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let Ok(flat) = &mut self.flat else { return };
        match self.gradients.get::<D>(param.id).map(values).transpose() {
            Ok(Some(gradient)) => flat.extend(gradient),
            Ok(None) => flat.resize(flat.len() + param.shape().num_elements(), 0.0),
            Err(error) => self.flat = Err(error),
        }
    }
}

/// Each parameter as a vector without gradients.
struct Parameters(Vec<Tensor<1>>);

impl ModuleVisitor for Parameters {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let n = param.shape().num_elements();
        self.0.push(param.val().inner().reshape([n]));
    }
}

/// Each parameter's gradient as a vector; zeros for one that took no part.
struct Gradients<'g> {
    gradients: &'g GradientsParams,
    device: Device,
    flat: Vec<Tensor<1>>,
}

impl ModuleVisitor for Gradients<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let n = param.shape().num_elements();
        let gradient = self.gradients.get::<D>(param.id).map(|gradient| gradient.reshape([n]));
        self.flat.push(gradient.unwrap_or_else(|| Tensor::zeros([n], &self.device)));
    }
}

/// Gives parameters their values on the processor.
struct FromHost<'v> {
    values: &'v [f32],
}

impl ModuleMapper for FromHost<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (values, rest) = self.values.split_at(param.shape().num_elements());
        self.values = rest;
        let data = TensorData::new(values.to_vec(), param.shape());
        with_value(param, |device| Tensor::from_data(data, device))
    }
}

/// Gives parameters their parts of a vector.
struct FromFlat {
    flat: Tensor<1>,
    begin: usize,
}

impl ModuleMapper for FromFlat {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let shape = param.shape();
        let part = self.flat.clone().narrow(0, self.begin, shape.num_elements());
        self.begin += shape.num_elements();
        with_value(param, |_device| part.reshape(shape))
    }
}

/// The same parameter with another value, which has no gradients; it requires one if it did before.
fn with_value<const D: usize>(param: Param<Tensor<D>>, value: impl FnOnce(&Device) -> Tensor<D>) -> Param<Tensor<D>> {
    param.map(|before| {
        let after = Tensor::from_inner(value(&before.device().without_autodiff()));
        if before.is_require_grad() { after.require_grad() } else { after }
    })
}
