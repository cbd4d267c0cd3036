//! A tiny forward of every variant that reads positions, by hand.
//!
//! Every width is 1, every weight and bias 0.1, and the one slot lies where the open gripper is, in the one frame of
//! the demonstration and now. So each layer of `n` inputs gives 0.1 times their sum, and 0.1 more where it has a bias;
//! a position gives (0, 0, 0, 1, 1, 1), the gripper (1, 0), and every sum is above zero, where rectifiers do nothing.

use burn::module::{ModuleMapper, Param};
use burn::tensor::{Device, Tensor};
use ntp::model::{
    CalledWith, FlattenedConfig, InstructedConfig, ModelConfig, Network, NetworkConfig, NetworkUse,
    ObjectCentricConfig, Pictures, SpecificationRows, States, Variant, Windows, with_network,
};
use ntp::program::Program;
use ntp::seed::Seed;
use ntp::task::Family;
use ntp::trace::{ObservationRows, SpecificationForm, Words};

/// Two words, as numbers; none of a third.
const SENTENCE: Words = [1, 2, 0];

/// x, y, z, open, closed.
fn row() -> ObservationRows {
    ObservationRows::new(1, vec![0.0, 0.0, 0.0, 1.0, 0.0])
}

/// What a network says: hidden of the core, logit of the end, of each program, of each scoping label, of the slot.
#[derive(Debug)]
struct Said {
    hidden: f32,
    end: f32,
    program: f32,
    label: Option<f32>,
    slot: f32,
}

struct Tenths;

impl ModuleMapper for Tenths {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<D>>) -> Param<Tensor<D>> {
        parameter.map(|values| values.zeros_like() + 0.1)
    }
}

/// All values of a tensor, which are the same.
fn alike<const D: usize>(tensor: Tensor<D>) -> f32 {
    let values: Vec<f32> = tensor.into_data().try_into_vec().unwrap();
    assert!(values.iter().all(|value| (value - values[0]).abs() < 1e-6), "{values:?}");
    values[0]
}

struct Saying(SpecificationForm);

impl NetworkUse for Saying {
    type Output = Said;

    fn run<N: Network>(self, network: N) -> Said {
        let network = network.map(&mut Tenths);
        let percepts = network.perceive(&Pictures::default()).unwrap();
        let windows = match self.0 {
            SpecificationForm::Instructions => SpecificationRows::Sentences(vec![SENTENCE]),
            SpecificationForm::Trajectories | SpecificationForm::Video => SpecificationRows::Observations(row()),
        };
        let demonstration = network.demonstration(&Windows::new(1, &[&windows]).unwrap(), &percepts).unwrap();
        let state = States::Observations(row());
        let reading = network.read(&demonstration, &state, &percepts, &[CalledWith::default()]).unwrap();
        let (core, _) = network.core(&reading, Program::Pick.into(), &[1], None);
        Said {
            hidden: alike(core.hidden.clone()),
            end: alike(core.end.clone()),
            program: alike(core.programs.clone()),
            label: network.scope(&reading, Program::Pick.into(), &core).map(alike),
            slot: alike(network.argument(&reading, Program::Pick.into(), &core)),
        }
    }
}

fn say(variant: Variant, form: SpecificationForm) -> Said {
    let object_centric =
        ObjectCentricConfig { pair_width: 1, width: 1, program_width: 1, scope_kernel: 1, argument_kernel: 1 };
    let flattened =
        FlattenedConfig { width: 1, program_width: 1, scope_kernel: 1, argument_kernel: 1, relations: false };
    let mut config = ModelConfig::new(variant, form, Family::BlockStacking, 1, serde_json::Value::Null);
    config.network = match config.network {
        NetworkConfig::ObjectCentric(_) => NetworkConfig::ObjectCentric(object_centric),
        NetworkConfig::Flattened(_) => NetworkConfig::Flattened(flattened),
        NetworkConfig::Instructed(_) => {
            NetworkConfig::Instructed(InstructedConfig { width: 1, program_width: 1, scope_kernel: 1 })
        }
        other => panic!("{other:?} sees"),
    };
    with_network(&config, Seed(1), &Device::flex(), Saying(form)).unwrap()
}

/// `expected`: hidden, label, slot. Key and end are 0.1 hidden + 0.1; a program's logit is its key's product with 0.1.
#[track_caller]
fn check_in(form: SpecificationForm, variants: &[Variant], (hidden, label, slot): (f32, Option<f32>, f32)) {
    let near = |found: f32, expected: f32| (found - expected).abs() < 1e-5;
    for &variant in variants {
        let said = say(variant, form);
        let key = 0.1 * hidden + 0.1;
        assert!(
            near(said.hidden, hidden) && near(said.end, key) && near(said.program, 0.1 * key),
            "{variant}: {said:?}"
        );
        assert_eq!(said.label.is_some(), label.is_some(), "{variant}");
        let label_is_near = said.label.zip(label).is_none_or(|(found, expected)| near(found, expected));
        assert!(label_is_near && near(said.slot, slot), "{variant}: {said:?}");
    }
}

#[track_caller]
fn check(variants: &[Variant], expected: (f32, Option<f32>, f32)) {
    check_in(SpecificationForm::Trajectories, variants, expected);
}

/// ```text
/// pair       0.1 * 3 + (0.1 * 3 + 0.1) = 0.7      → 0.17
/// slot       0.1 * 0.17 + 0.1 * 4 + (0.1 * 4 + 0.1) = 0.917 → u = 0.1917
/// frame      v = 0.1917, convolved y = 0.11917
/// state      0.1 * 4 + 0.1 = 0.5 → 0.15, with the gripper (0.15, 1, 0)
/// core       0.1 * (0.11917 + 0.1917 + 0.1 + 1.15) + 0.1 = 0.256087
/// label      0.1 * (0.1 * 0.11917 + 0.1 * (0.1 + 1.15) + 0.1) + 0.1 = 0.1236917
/// slot       0.1 * (0.1 * (0.11917 + 0.1917) + 0.1 * (0.1 + 0.256087) + 0.1) + 0.1 = 0.1166696
/// ```
#[test]
fn reactive_object_centric_networks_compute_what_they_say() {
    check(&[Variant::NTP], (0.256_087, Some(0.123_691_7), 0.116_669_6));
    check(&[Variant::NTP_NO_SCOPE, Variant::FLAT], (0.256_087, None, 0.116_669_6));
}

/// The cell reads x = 0.256087 and remembers nothing: all gates 0.1256087, beside 0.1 of what it remembers;
/// z = r = sigmoid(0.2256087) = 0.556164, n = tanh(0.1256087 + 0.0556164) = 0.179266, h = (1 - z) n = 0.079565.
/// It stands for the state in label and slot: 0.1 * (0.0119170 + 0.1 * (0.1 + h) + 0.1) + 0.1 = 0.1129873,
/// 0.1 * (0.0310870 + 0.1 * (0.1 + h) + 0.1) + 0.1 = 0.1149043.
#[test]
fn recurrent_object_centric_networks_compute_what_they_say() {
    check(&[Variant::NTP_GRU], (0.079_565_1, Some(0.112_987_3), 0.114_904_3));
    check(&[Variant::FLAT_GRU], (0.079_565_1, None, 0.114_904_3));
}

/// ```text
/// state      0.1 * 4 + 0.1 = 0.5 → 0.15
/// frame      likewise 0.15, convolved 0.115; summary 0.1 * (0.115 + 0.15 + 0.15) + 0.1 = 0.1415
/// core       0.1 * (0.1415 + 0.1 + 0.15) + 0.1 = 0.13915 → 0.113915
/// label      0.1 * (0.1 * 0.115 + 0.1 * (0.1 + 0.15) + 0.1) + 0.1 = 0.11365
/// slot       0.1 * (0.1415 + 0.1 + 0.15) + 0.1 = 0.13915 → 0.113915
/// ```
#[test]
fn reactive_flattened_networks_compute_what_they_say() {
    check(&[Variant::NTP_PAPER], (0.113_915, Some(0.113_65), 0.113_915));
    check(&[Variant::NTP_NO_SCOPE_PAPER, Variant::FLAT_PAPER], (0.113_915, None, 0.113_915));
}

/// As the object-centric cell with x = 0.113915: gates 0.1113915, z = r = sigmoid(0.2113915) = 0.552652,
/// n = tanh(0.1113915 + 0.0552652) = 0.165129, h = 0.0738709.
/// Label 0.1 * (0.0115 + 0.1 * (0.1 + h) + 0.1) + 0.1 = 0.1128887, slot 0.1 * (0.1 * (0.1415 + 0.1 + h) + 0.1) + 0.1.
#[test]
fn recurrent_flattened_networks_compute_what_they_say() {
    check(&[Variant::NTP_GRU_PAPER], (0.073_870_9, Some(0.112_888_7), 0.113_153_7));
    check(&[Variant::FLAT_GRU_PAPER], (0.073_870_9, None, 0.113_153_7));
}

/// ```text
/// slot       pair 0.1 * 3 + 0.1 = 0.4; 0.1 * (0.4 + 4) + 0.1 = 0.54 → 0.154; as one vector 0.1 * 4 + 0.1 = 0.5 → 0.15
/// cell       x = 0.1 * (0.154 + 0.1) + 0.1 = 0.1254, or 0.125; gates g = 0.1 x + 0.2
///            c = sigmoid(g) tanh(g), h = sigmoid(g) tanh(c) = 0.0637359, or 0.0637221
/// argument   0.1 * (0.0154 + 0.1 * (0.1 + h) + 0.1) + 0.1 = 0.1131774
///            0.1 * (0.1 * (0.15 + 0.1 + h) + 0.1) + 0.1 = 0.1131372
/// ```
#[test]
fn the_ancestors_networks_compute_what_they_say() {
    check(&[Variant::NPI], (0.063_735_9, None, 0.113_177_4));
    check(&[Variant::NPI_PAPER], (0.063_722_1, None, 0.113_137_2));
}

/// ```text
/// sentence   words 0.1 * 2 + 0.1 = 0.3, meant slot's place 0.1 * 4 = 0.4, no others: 0.7 → 0.17, convolved 0.117
/// core       0.1 * (0.117 + 0.17 + 0.1 + 1.15) + 0.1 = 0.2537
/// label      0.1 * (0.1 * 0.117 + 0.1 * (0.1 + 1.15) + 0.1) + 0.1 = 0.12367
/// slot       8 * (0.1 * 2 + 0.1) = 2.4, all of the attention on the only sentence
/// ```
#[test]
fn the_network_of_instructions_computes_what_it_says() {
    check_in(SpecificationForm::Instructions, &[Variant::NTP], (0.253_7, Some(0.123_67), 2.4));
}
