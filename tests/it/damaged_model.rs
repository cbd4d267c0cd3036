//! Models whose files were damaged: each is refused with its path, what was found and what is allowed.

use std::path::Path;

use burn::module::{Module as _, ModuleMapper, Param};
use burn::tensor::{Device, FloatDType, Tensor};
use ntp::model::{
    CONFIG_FILE, Decoder, ModelConfig, Network, NetworkConfig, NetworkUse, Ntp, ObjectCentric, ObjectCentricConfig,
    Variant, WEIGHTS_FILE, inspect, weights_to_bytes, with_network,
};
use ntp::rollout::load_policy;
use ntp::seed::Seed;
use ntp::task::Family;
use ntp::trace::SpecificationForm;
use serde_json::Value;

use crate::pipeline::run;

const SMALL: ObjectCentricConfig =
    ObjectCentricConfig { pair_width: 2, width: 4, program_width: 3, scope_kernel: 3, argument_kernel: 1 };

fn config(variant: Variant) -> ModelConfig {
    let form = variant.specification(SpecificationForm::default());
    let config = ModelConfig::new(variant, form, Family::BlockStacking, 8, Value::Null);
    let network = match config.network {
        NetworkConfig::ObjectCentric(_) => NetworkConfig::ObjectCentric(SMALL),
        other => other.for_pictures(64, 1, 8).narrowed(64),
    };
    ModelConfig { network, ..config }
}

struct Bytes;

impl NetworkUse for Bytes {
    type Output = Vec<u8>;

    fn run<N: Network>(self, network: N) -> Vec<u8> {
        weights_to_bytes(&network, "x".as_ref()).unwrap()
    }
}

/// Writes a small model.
pub(crate) fn small_model(folder: &Path, variant: Variant) {
    let config = config(variant);
    let weights = with_network(&config, Seed(1), &Device::flex(), Bytes).unwrap();
    ntp::artifact::write_json(&folder.join(CONFIG_FILE), &config).unwrap();
    std::fs::write(folder.join(WEIGHTS_FILE), weights).unwrap();
}

/// What is said of a model when it is looked at, which is also said when it is to act.
#[track_caller]
fn refusal(folder: &Path) -> String {
    let error = inspect(folder).unwrap_err().to_string();
    assert!(error.contains(&folder.display().to_string()), "{error}");
    assert_eq!(load_policy(folder, Decoder::Mss).err().map(|error| error.to_string()), Some(error.clone()));
    error
}

/// All places of whole numbers in a JSON value, as pointers.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(at.to_owned()),
        Value::Object(map) => map.iter().for_each(|(key, value)| numbers(value, &format!("{at}/{key}"), found)),
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(idx, value)| numbers(value, &format!("{at}/{idx}"), found));
        }
        _ => {}
    }
}

#[test]
fn no_size_of_a_network_may_be_nothing_or_beyond_all_measure() {
    for variant in Variant::named() {
        let folder = tempfile::tempdir().unwrap();
        small_model(folder.path(), variant);
        let path = folder.path().join(CONFIG_FILE);
        let whole: Value = ntp::artifact::read_json(&path).unwrap();
        inspect(folder.path()).unwrap();
        let mut sizes = Vec::new();
        numbers(&whole["network"], "/network", &mut sizes);
        sizes.push("/n_slots".to_owned());
        assert!(sizes.len() >= 3);
        for size in sizes {
            for wrong in [0_u64, 65_537, u64::MAX] {
                let mut damaged = whole.clone();
                *damaged.pointer_mut(&size).unwrap() = wrong.into();
                ntp::artifact::write_json(&path, &damaged).unwrap();
                let key = size.rsplit('/').next().unwrap();
                let said = refusal(folder.path());
                // Sizes that hang on others may be named by these.
                let named =
                    [key, "colours", "slots", "patch"].iter().any(|key| said.contains(&format!("{key} is {wrong}")));
                assert!(named || said.contains("allowed"), "{variant} {size} {wrong}: {said}");
            }
        }
    }
}

#[test]
fn a_width_of_nothing_ends_inspect_with_an_error_and_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    small_model(folder.path(), Variant::NTP);
    let path = folder.path().join(CONFIG_FILE);
    let mut config: Value = ntp::artifact::read_json(&path).unwrap();
    config["network"]["object_centric"]["width"] = 0.into();
    ntp::artifact::write_json(&path, &config).unwrap();
    let (code, _, stderr) = run(&["inspect", &folder.path().display().to_string()]);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("width is 0; allowed: 1 to 65536"), "{stderr}");
}

#[test]
fn a_kernel_without_a_middle_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    small_model(folder.path(), Variant::NTP);
    let even = ObjectCentricConfig { scope_kernel: 4, ..SMALL };
    let even = ModelConfig { network: NetworkConfig::ObjectCentric(even), ..config(Variant::NTP) };
    ntp::artifact::write_json(&folder.path().join(CONFIG_FILE), &even).unwrap();
    assert!(refusal(folder.path()).contains("scope_kernel is 4; allowed: odd, 1 to 1001"));
}

/// Writes other weights beside the small model's configuration, and gives what is said of them.
#[track_caller]
fn refusal_of_weights(network: &Ntp<ObjectCentric>) -> String {
    let folder = tempfile::tempdir().unwrap();
    small_model(folder.path(), Variant::NTP);
    std::fs::write(folder.path().join(WEIGHTS_FILE), weights_to_bytes(network, "x".as_ref()).unwrap()).unwrap();
    refusal(folder.path())
}

fn network(widths: &ObjectCentricConfig) -> Ntp<ObjectCentric> {
    Ntp::new(widths, 8, Seed(1), &Device::flex())
}

/// Numbers of twice the width: they load as they are, and no read of 32-bit numbers succeeds on them.
struct Doubled;

impl ModuleMapper for Doubled {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<D>>) -> Param<Tensor<D>> {
        parameter.map(|values| values.cast(FloatDType::F64))
    }
}

/// The first number of the last parameter is none.
struct NotANumber;

impl ModuleMapper for NotANumber {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<D>>) -> Param<Tensor<D>> {
        parameter.map(|values| values.zeros_like().log() - f32::INFINITY)
    }
}

#[test]
fn weights_of_another_type_are_refused_by_the_tensor_s_name() {
    let said = refusal_of_weights(&network(&SMALL).map(&mut Doubled));
    assert!(said.contains("tensor \"argument.context.bias\" is of F64; allowed is F32"), "{said}");
}

#[test]
fn weights_that_are_no_numbers_are_refused_by_the_tensor_s_name() {
    let said = refusal_of_weights(&network(&SMALL).map(&mut NotANumber));
    assert!(said.contains("tensor \"encoder.pair_demonstration.weight\" has -inf at 0"), "{said}");
}

#[test]
fn weights_of_another_shape_are_refused_by_the_tensor_s_name() {
    let said = refusal_of_weights(&network(&ObjectCentricConfig { pair_width: 3, ..SMALL }));
    assert!(said.contains("Shape mismatch for 'encoder.pair_demonstration.weight'"), "{said}");
}

#[test]
fn a_missing_tensor_and_one_too_many_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for (weights_of, config_of, expected) in [
        (Variant::NTP_NO_SCOPE, Variant::NTP, "tensor \"scope.context.bias\" is missing"),
        (Variant::NTP, Variant::NTP_NO_SCOPE, "tensor \"scope.context.bias\" is not one of the network's"),
    ] {
        small_model(folder.path(), weights_of);
        ntp::artifact::write_json(&folder.path().join(CONFIG_FILE), &config(config_of)).unwrap();
        let said = refusal(folder.path());
        assert!(said.contains(expected), "{said}");
    }
}
