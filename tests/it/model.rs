//! Networks, decoders, model folders and the learned policy.

use burn::tensor::{Device, Tensor};
use ntp::model::{
    CONFIG_FILE, CalledWith, Cell as _, Decoder, Flattened, FlattenedConfig, Gru, Instructed, InstructedConfig,
    LabelScores, Linear, Lstm, ModelConfig, ModelError, Network, NetworkUse, Ntp, NtpGru, ObjectCentric,
    ObjectCentricConfig, Pictures, ProgramMemory, ReadError, ScopeHead, ScopingKind, Sentences, SpecificationRows,
    States, Variant, WEIGHTS_FILE, Windows, check_purpose, inspect, span_score, weights_to_bytes, with_network,
};
use ntp::program::Program;
use ntp::rollout::{Allowed, Decision, LearnedPolicy, Policy as _, Query, Specification, load_policy};
use ntp::scene::SlotIndex;
use ntp::seed::Seed;
use ntp::task::{Family, Split};
use ntp::trace::{Observation, ObservationRows, Span, SpecificationForm, Words};
use proptest::prelude::{ProptestConfig, prop, prop_assert, proptest};
use rand::Rng as _;

use crate::kinematic::{demonstration, tower, trial};

fn device() -> Device {
    Device::flex()
}

fn object_centric(seed: u64) -> Ntp<ObjectCentric> {
    Ntp::new(&ObjectCentricConfig::default(), 8, Seed(seed), &device())
}

fn flattened(seed: u64) -> Ntp<Flattened> {
    Ntp::new(&FlattenedConfig::default(), 8, Seed(seed), &device())
}

fn recurrent(seed: u64) -> NtpGru<ObjectCentric> {
    NtpGru::new(&ObjectCentricConfig::default(), 8, Seed(seed), &device())
}

/// Does something with a fresh network of every variant that is given positions.
fn with_every<U: NetworkUse>(mut wanted: impl FnMut(Variant) -> U) -> Vec<(Variant, U::Output)> {
    let network = |variant| (variant, with_network(&config(variant), Seed(1), &device(), wanted(variant)).unwrap());
    Variant::every().filter(|variant| !variant.sees()).map(network).collect()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec().unwrap()
}

/// Windows of observation rows.
fn windows(n_slots: usize, windows: &[&[f32]]) -> Windows {
    let rows = |rows: &&[f32]| SpecificationRows::Observations(ObservationRows::new(n_slots, rows.to_vec()));
    let windows: Vec<SpecificationRows> = windows.iter().map(rows).collect();
    Windows::new(n_slots, &windows.iter().collect::<Vec<_>>()).unwrap()
}

/// Windows of sentences for scenes of three slots.
fn sentence_windows(windows: &[&[Words]]) -> Windows {
    let windows: Vec<SpecificationRows> =
        windows.iter().map(|sentences| SpecificationRows::Sentences(sentences.to_vec())).collect();
    Windows::new(3, &windows.iter().collect::<Vec<_>>()).unwrap()
}

fn states_of(n_slots: usize, rows: &[f32]) -> States {
    States::Observations(ObservationRows::new(n_slots, rows.to_vec()))
}

/// Random observation rows.
fn rows(n_rows: usize, n_slots: usize, seed: u64) -> Vec<f32> {
    let mut rng = Seed(seed).rng();
    let mut row = || {
        let closed = f32::from(u8::from(rng.random::<bool>()));
        let mut row: Vec<f32> = (0..3 * n_slots).map(|_| rng.random_range(-0.3..0.3)).collect();
        row.extend([1.0 - closed, closed]);
        row
    };
    (0..n_rows).flat_map(|_| row()).collect()
}

/// Everything a network says about one program, window after window.
struct Said {
    programs: Vec<f32>,
    ends: Vec<f32>,
    scopes: Vec<f32>,
    arguments: Vec<f32>,
}

fn say(network: &impl Network, n_slots: usize, shown: &[&[f32]], states: &[f32], program: Program) -> Said {
    let batch = windows(n_slots, shown);
    let demonstration = network.demonstration(&batch, &network.perceive(&Pictures::default()).unwrap()).unwrap();
    let reading = network
        .read(
            &demonstration,
            &states_of(n_slots, states),
            &network.perceive(&Pictures::default()).unwrap(),
            &vec![CalledWith::default(); shown.len()],
        )
        .unwrap();
    let (core, _) = network.core(&reading, program.into(), &[shown.len()], None);
    Said {
        programs: values(core.programs.clone()),
        ends: values(core.end.clone()),
        scopes: network.scope(&reading, program.into(), &core).map(values).unwrap_or_default(),
        arguments: values(network.argument(&reading, program.into(), &core)),
    }
}

#[track_caller]
fn assert_near(found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    for (position, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() < 1e-5, "at {position}: {a} is not {b}");
    }
}

struct Parameters;

impl NetworkUse for Parameters {
    type Output = usize;

    fn run<N: Network>(self, network: N) -> usize {
        network.num_params()
    }
}

/// A row of 16 features in the memory and one among the keys.
#[test]
fn a_model_has_a_row_for_each_program_that_its_family_needs() {
    let parameters = |family| {
        let config = ModelConfig::new(Variant::NTP, SpecificationForm::default(), family, 8, serde_json::Value::Null);
        with_network(&config, Seed(0), &device(), Parameters).unwrap()
    };
    assert_eq!(parameters(Family::ObjectSorting), parameters(Family::BlockStacking));
    assert_eq!(parameters(Family::Kitting), parameters(Family::BlockStacking) + 2 * 16);
}

#[test]
fn parameter_counts_are_what_they_were() {
    let counts = with_every(|_| Parameters);
    let count = |name: &str| counts.iter().find(|(variant, _)| variant.name() == name).unwrap().1;
    for (name, expected) in [
        ("ntp", 23_982),
        ("ntp_paper", 251_277),
        ("ntp_gru", 30_254),
        ("ntp_gru_paper", 307_149),
        ("ntp_no_scope", 20_170),
        ("ntp_no_scope_paper", 229_289),
        ("flat", 20_170),
        ("flat_paper", 229_289),
        ("flat_gru", 26_506),
        ("flat_gru_paper", 285_161),
        ("npi", 26_487),
        ("npi_paper", 129_777),
    ] {
        assert_eq!(count(name), expected, "{name}");
    }
}

#[test]
fn the_same_seed_gives_the_same_parameters() {
    let bytes = |network: &Ntp<ObjectCentric>| weights_to_bytes(network, "x".as_ref()).unwrap();
    assert_eq!(bytes(&object_centric(1)), bytes(&object_centric(1)));
    assert_ne!(bytes(&object_centric(1)), bytes(&object_centric(2)));
}

/// Keys (1, 0), (0, 2), (-1, 1) and the query (3, 1): scores are 3, 2, -2.
#[test]
fn program_memory_scores_by_the_product_of_keys() {
    let tensor = |rows: [[f32; 2]; 3]| Tensor::<2>::from_data(rows, &device());
    let memory = ProgramMemory::from_rows(
        tensor([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
        tensor([[1.0, 0.0], [0.0, 2.0], [-1.0, 1.0]]),
    );
    let query = Tensor::<2>::from_data([[3.0_f32, 1.0]], &device());
    assert_eq!(values(memory.address(query)), [3.0, 2.0, -2.0]);
    assert_eq!(values(memory.embedding(Program::BlockStacking)), [3.0, 4.0]);
}

/// One hidden unit: relu(2 * frame + (3 * context - 1)), then labels (1, -1, 0.5, 0) times it plus (0, 0, 0, 0.25).
/// With context 0.5 the frames 1 and -1 give hidden 2.5 and 0.
#[test]
fn the_scoping_head_computes_what_it_says() {
    let head = ScopeHead::from_layers(
        linear(Tensor::from_data([[2.0_f32]], &device()), None),
        linear(Tensor::from_data([[3.0_f32]], &device()), Some(vec![-1.0])),
        linear(Tensor::from_data([[1.0_f32, -1.0, 0.5, 0.0]], &device()), Some(vec![0.0, 0.0, 0.0, 0.25])),
    );
    let frames = Tensor::<3>::from_data([[[1.0_f32], [-1.0]]], &device());
    let context = Tensor::<2>::from_data([[0.5_f32]], &device());
    assert_near(&values(head.forward(frames, context)), &[2.5, -2.5, 1.25, 0.25, 0.0, 0.0, 0.0, 0.25]);
}

struct Padding;

impl NetworkUse for Padding {
    type Output = ();

    fn run<N: Network>(self, network: N) {
        let (short, long) = (rows(3, 8, 1), rows(7, 8, 2));
        let states = rows(2, 8, 3);
        let together = say(&network, 8, &[&short, &long], &states, Program::Pick);
        let alone = say(&network, 8, &[&short], &states[..26], Program::Pick);
        assert_near(&together.programs[..alone.programs.len()], &alone.programs);
        assert_near(&together.ends[..1], &alone.ends);
        assert_near(&together.scopes[..alone.scopes.len()], &alone.scopes);
        assert_near(&together.arguments[..alone.arguments.len()], &alone.arguments);
    }
}

#[test]
fn padding_changes_nothing_within_a_window() {
    with_every(|_| Padding);
}

/// What a network says of the steps of two calls of 3 and 1 steps, packed, and one after another.
struct Packing;

impl NetworkUse for Packing {
    type Output = bool;

    fn run<N: Network>(self, network: N) -> bool {
        let (window, states) = (rows(5, 8, 1), rows(4, 8, 3));
        // Rows 0, 2 and 3 are the first call's, row 1 the second's.
        let demonstration = network
            .demonstration(&windows(8, &[window.as_slice(); 4]), &network.perceive(&Pictures::default()).unwrap())
            .unwrap();
        let reading = network
            .read(
                &demonstration,
                &states_of(8, &states),
                &network.perceive(&Pictures::default()).unwrap(),
                &[CalledWith::default(); 4],
            )
            .unwrap();
        let (packed, _) = network.core(&reading, Program::Pick.into(), &[2, 1, 1], None);
        let packed = values(packed.programs);
        let mut recall = None;
        let mut alone = Vec::new();
        for step in [0, 2, 3] {
            let demonstration = network
                .demonstration(&windows(8, &[&window]), &network.perceive(&Pictures::default()).unwrap())
                .unwrap();
            let reading = network
                .read(
                    &demonstration,
                    &states_of(8, &states[step * 26..(step + 1) * 26]),
                    &network.perceive(&Pictures::default()).unwrap(),
                    &[CalledWith::default()],
                )
                .unwrap();
            let (core, remembered) = network.core(&reading, Program::Pick.into(), &[1], recall.take());
            recall = Some(remembered);
            let programs = values(core.programs);
            assert_near(&programs, &packed[step * programs.len()..][..programs.len()]);
            alone.push(programs);
        }
        let (afresh, _) = network.core(
            &network
                .read(
                    &network
                        .demonstration(&windows(8, &[&window]), &network.perceive(&Pictures::default()).unwrap())
                        .unwrap(),
                    &states_of(8, &states[2 * 26..3 * 26]),
                    &network.perceive(&Pictures::default()).unwrap(),
                    &[CalledWith::default()],
                )
                .unwrap(),
            Program::Pick.into(),
            &[1],
            None,
        );
        values(afresh.programs).iter().zip(&alone[1]).any(|(a, b)| (a - b).abs() > 1e-6)
    }
}

#[test]
fn packed_steps_are_the_same_as_steps_one_by_one_and_only_recurrent_networks_remember() {
    for (variant, remembers) in with_every(|_| Packing) {
        assert_eq!(remembers, variant.core().is_recurrent(), "{variant}");
    }
}

/// What a network that knows two tasks says to a root, told by its task, and to another program, told by a slot.
struct Told(Vec<CalledWith>);

impl NetworkUse for Told {
    type Output = Vec<Vec<f32>>;

    fn run<N: Network>(self, network: N) -> Self::Output {
        let state = rows(1, 8, 3);
        let demonstration =
            network.demonstration(&windows(8, &[&state]), &network.perceive(&Pictures::default()).unwrap()).unwrap();
        let say = |given: &CalledWith| {
            let reading = network
                .read(
                    &demonstration,
                    &states_of(8, &state),
                    &network.perceive(&Pictures::default()).unwrap(),
                    std::slice::from_ref(given),
                )
                .unwrap();
            let (core, _) = network.core(&reading, Program::Pick.into(), &[1], None);
            let arguments = values(network.argument(&reading, Program::Pick.into(), &core));
            assert_eq!(arguments.len(), 8 * network.scoping().n_arguments());
            values(core.programs)
        };
        self.0.iter().map(say).collect()
    }
}

#[test]
fn npi_is_told_by_arguments_and_by_the_names_of_tasks_that_it_knows() {
    let task = |task| CalledWith { task, ..CalledWith::default() };
    let slot = |slot| CalledWith { arguments: [Some(SlotIndex(slot)), None], ..CalledWith::default() };
    let given = [task(None), task(Some(0)), task(Some(1)), task(Some(9)), slot(0), slot(5)];
    for variant in [Variant::NPI, Variant::NPI_PAPER] {
        let knowing = ModelConfig { tasks: vec!["a".to_owned(), "b".to_owned()], ..config(variant) };
        let said = with_network(&knowing, Seed(1), &device(), Told(given.to_vec())).unwrap();
        assert_eq!(said[0], said[3], "a task without a row is no task");
        for (idx, other) in [(1, 0), (2, 0), (2, 1), (4, 0), (5, 0), (5, 4)] {
            assert_ne!(said[idx], said[other], "{variant}: {idx} and {other}");
        }
    }
}

fn linear(weight: Tensor<2>, bias: Option<Vec<f32>>) -> Linear {
    let bias = bias.map(|bias| burn::module::Param::from_data(bias.as_slice(), &device()));
    Linear::new(burn::module::Param::from_tensor(weight), bias)
}

/// x = 1, h = 0.5, W = (1, -1, 2) with bias (0, 0, 0.5), U = (2, 0, 3):
/// z = sigmoid(1 + 1) = 0.880797, r = sigmoid(-1) = 0.268941, n = tanh(2.5 + 0.268941 * 1.5) = 0.994033,
/// h' = (1 - z) n + 0.5 z = 0.118492 + 0.440399 = 0.558890.
#[test]
fn the_gru_computes_what_it_says() {
    let cell = Gru::from_layers(
        linear(Tensor::from_data([[1.0_f32, -1.0, 2.0]], &device()), Some(vec![0.0, 0.0, 0.5])),
        linear(Tensor::from_data([[2.0_f32, 0.0, 3.0]], &device()), None),
    );
    let hidden =
        cell.step(cell.project(Tensor::from_data([[1.0_f32]], &device())), Tensor::from_data([[0.5_f32]], &device()));
    assert_near(&values(Gru::hidden(&hidden)), &[0.558_890]);
}

/// x = 1, h = 0.5, c = 2, W = (1, 0, -1, 0.5), U = (0, 2, 0, 1):
/// i = sigmoid(1) = 0.731059, f = sigmoid(1) = 0.731059, o = sigmoid(-1) = 0.268941, g = tanh(1) = 0.761594,
/// c' = 1.462117 + 0.556770 = 2.018887, h' = 0.268941 * tanh(2.018887) = 0.259619.
#[test]
fn the_lstm_computes_what_it_says() {
    let tensor = |row: f32| Tensor::<2>::from_data([[row]], &device());
    let cell = Lstm::from_layers(
        linear(Tensor::from_data([[1.0_f32, 0.0, -1.0, 0.5]], &device()), None),
        linear(Tensor::from_data([[0.0_f32, 2.0, 0.0, 1.0]], &device()), None),
    );
    let [hidden, memory] = cell.step(cell.project(tensor(1.0)), [tensor(0.5), tensor(2.0)]);
    assert_near(&[values(hidden), values(memory)].concat(), &[0.259_619, 2.018_887]);
}

/// Sentences of three words of a vocabulary for 3 slots, as numbers.
fn sentences(n: u16) -> Vec<Words> {
    (0..n).map(|sentence| [2, 3, 6 + sentence % 3]).collect()
}

fn instructed() -> Ntp<Instructed> {
    Ntp::new(&InstructedConfig::default(), 3, Seed(5), &device())
}

/// Programs, ends and arguments, and the labels of the first two sentences.
fn follow(demonstration: &Sentences, states: &[f32]) -> Said {
    let network = instructed();
    let reading = network
        .read(
            demonstration,
            &states_of(3, states),
            &network.perceive(&Pictures::default()).unwrap(),
            &[CalledWith::default()],
        )
        .unwrap();
    let (core, _) = network.core(&reading, Program::Pick.into(), &[1], None);
    let scopes = network.scope(&reading, Program::Pick.into(), &core).map(values).unwrap_or_default();
    Said {
        programs: values(core.programs.clone()),
        ends: values(core.end.clone()),
        scopes: scopes[..8].to_vec(),
        arguments: values(network.argument(&reading, Program::Pick.into(), &core)),
    }
}

#[test]
fn a_cut_of_instructions_reads_as_its_part_alone() {
    let (network, state) = (instructed(), rows(1, 3, 7));
    let all = sentences(5);
    let whole =
        network.demonstration(&sentence_windows(&[&all]), &network.perceive(&Pictures::default()).unwrap()).unwrap();
    let cut = <Ntp<Instructed> as Network>::window(&whole, Span { begin: 1, end: 3 });
    let alone = network
        .demonstration(&sentence_windows(&[&all[1..3]]), &network.perceive(&Pictures::default()).unwrap())
        .unwrap();
    let (cut, alone) = (follow(&cut, &state), follow(&alone, &state));
    assert_near(&cut.programs, &alone.programs);
    assert_near(&cut.scopes, &alone.scopes);
    assert_near(&cut.arguments, &alone.arguments);
}

#[test]
fn padding_of_instructions_changes_nothing_within_a_window() {
    let (network, states) = (instructed(), rows(2, 3, 7));
    let (short, long) = (sentences(2), sentences(6));
    let padded = network
        .demonstration(&sentence_windows(&[&short, &long]), &network.perceive(&Pictures::default()).unwrap())
        .unwrap();
    let reading = network
        .read(
            &padded,
            &states_of(3, &states),
            &network.perceive(&Pictures::default()).unwrap(),
            &[CalledWith::default(); 2],
        )
        .unwrap();
    let (core, _) = network.core(&reading, Program::Pick.into(), &[2], None);
    let scopes = network.scope(&reading, Program::Pick.into(), &core).map(values).unwrap();
    let alone = follow(
        &network.demonstration(&sentence_windows(&[&short]), &network.perceive(&Pictures::default()).unwrap()).unwrap(),
        &states[..11],
    );
    assert_near(&values(core.end.clone())[..1], &alone.ends);
    assert_near(&scopes[..8], &alone.scopes);
    assert_near(&values(network.argument(&reading, Program::Pick.into(), &core))[..3], &alone.arguments);
}

#[test]
fn the_encoder_of_instructions_has_as_many_parameters_as_it_had() {
    let config = InstructedConfig::default();
    assert_eq!(Parameters.run(Ntp::<Instructed>::new(&config, 8, Seed(0), &device())), 19_854);
}

#[test]
fn a_cut_demonstration_reads_as_its_part_alone() {
    let (network, all) = (object_centric(1), rows(9, 8, 4));
    let state = rows(1, 8, 5);
    let demonstration =
        network.demonstration(&windows(8, &[&all]), &network.perceive(&Pictures::default()).unwrap()).unwrap();
    let window = Ntp::<ObjectCentric>::window(&demonstration, Span { begin: 2, end: 6 });
    let reading = network
        .read(
            &window,
            &states_of(8, &state),
            &network.perceive(&Pictures::default()).unwrap(),
            &[CalledWith::default()],
        )
        .unwrap();
    let (core, _) = network.core(&reading, Program::PickAndPlace.into(), &[1], None);
    let cut = values(network.scope(&reading, Program::PickAndPlace.into(), &core).unwrap());
    let alone = say(&network, 8, &[&all[2 * 26..6 * 26]], &state, Program::PickAndPlace);
    assert_near(&cut, &alone.scopes);
}

#[test]
fn relabelled_slots_relabel_the_argument_of_the_object_centric_network_and_nothing_else() {
    let network = object_centric(3);
    let (n_slots, window, state) = (5, rows(4, 5, 6), rows(1, 5, 7));
    let order = [3, 0, 4, 1, 2];
    let relabel = |rows: &[f32]| -> Vec<f32> {
        let row = |row: &[f32]| -> Vec<f32> {
            let slots = order.iter().flat_map(|&slot| &row[3 * slot..3 * slot + 3]);
            slots.chain(&row[3 * n_slots..]).copied().collect()
        };
        rows.chunks_exact(Observation::width(n_slots)).flat_map(row).collect()
    };
    let (before, after) = (
        say(&network, n_slots, &[&window], &state, Program::Place),
        say(&network, n_slots, &[&relabel(&window)], &relabel(&state), Program::Place),
    );
    assert_near(&after.programs, &before.programs);
    assert_near(&after.scopes, &before.scopes);
    assert_near(&after.arguments, &order.map(|slot| before.arguments[slot]));
}

/// Log-probabilities of frames by their likely labels.
fn scores(labels: &str) -> Vec<LabelScores> {
    let score = |likely: char| ['S', 'E', 'I', 'O'].map(|label| if label == likely { -0.1_f32 } else { -4.0 });
    labels.chars().map(score).collect()
}

#[track_caller]
fn check_decoder(decoder: Decoder, labels: &str, begin: u32, end: u32) {
    assert_eq!(decoder.decode(&scores(labels)), Some(Span { begin, end }), "{} of {labels}", decoder.name());
}

#[test]
fn decoders_agree_on_clear_labels() {
    for decoder in Decoder::ALL {
        check_decoder(decoder, "OOSIIEOO", 2, 6);
        check_decoder(decoder, "SE", 0, 2);
        assert_eq!(decoder.decode(&[]), None);
    }
}

#[test]
fn argmax_never_ends_before_it_starts() {
    check_decoder(Decoder::Argmax, "EOSIO", 2, 3);
}

#[test]
fn sums_bridge_a_doubtful_frame() {
    check_decoder(Decoder::Mss, "OSIOIEO", 1, 6);
    check_decoder(Decoder::Am, "OSIOIEO", 1, 6);
    check_decoder(Decoder::Mss, "OOSIIEOIO", 2, 6);
}

#[test]
fn a_window_of_one_frame_is_its_own_part() {
    for decoder in Decoder::ALL {
        check_decoder(decoder, "O", 0, 1);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mss_and_am_find_the_likeliest_labellings(frames in prop::collection::vec(prop::array::uniform4(-9.0_f32..0.0), 1..25)) {
        let n_frames = frames.len() as u32;
        let highest = |begins: std::ops::Range<u32>| {
            let spans = begins.flat_map(|begin| (begin + 1..=n_frames).map(move |end| Span { begin, end }));
            spans.map(|span| span_score(&frames, span)).fold(f32::NEG_INFINITY, f32::max)
        };
        let mss = Decoder::Mss.decode(&frames).unwrap();
        prop_assert!(span_score(&frames, mss) >= highest(0..n_frames) - 1e-4);
        let am = Decoder::Am.decode(&frames).unwrap();
        prop_assert!(span_score(&frames, am) >= highest(am.begin..am.begin + 1) - 1e-4);
        prop_assert!(frames.iter().all(|scores| scores[0] <= frames[am.begin as usize][0]));
    }

    #[test]
    fn decoded_spans_lie_in_the_window(logits in prop::collection::vec(prop::array::uniform4(-30.0_f32..0.0), 1..30)) {
        for decoder in Decoder::ALL {
            let span = decoder.decode(&logits).unwrap();
            prop_assert!(span.begin < span.end && span.end as usize <= logits.len());
        }
    }
}

fn store(folder: &std::path::Path, config: &ModelConfig, weights: &[u8]) {
    ntp::artifact::write_json(&folder.join(CONFIG_FILE), config).unwrap();
    ntp::artifact::write(&folder.join(WEIGHTS_FILE), weights).unwrap();
}

fn config(variant: Variant) -> ModelConfig {
    ModelConfig::new(variant, SpecificationForm::default(), Family::BlockStacking, 8, serde_json::Value::Null)
}

#[test]
fn a_stored_model_decides_as_before() {
    let folder = tempfile::tempdir().unwrap();
    let network = flattened(5);
    store(folder.path(), &config(Variant::NTP_PAPER), &weights_to_bytes(&network, folder.path()).unwrap());
    let (_, mut loaded) = load_policy(folder.path(), Decoder::Mss).unwrap();
    let queries = queries();
    assert_eq!(loaded.name(), "ntp_paper");
    assert_eq!(
        loaded.decide(&queries).unwrap(),
        LearnedPolicy::new("ntp_paper", network, Decoder::Mss).decide(&queries).unwrap()
    );
}

#[test]
fn a_model_of_another_kind_is_refused_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let weights = weights_to_bytes(&object_centric(0), folder.path()).unwrap();
    let refused = |config: &ModelConfig, weights: &[u8]| {
        store(folder.path(), config, weights);
        let error = inspect(folder.path()).unwrap_err();
        assert!(error.to_string().contains(&folder.path().display().to_string()), "{error}");
        error
    };
    let other = ModelConfig { vocabulary: "0011".to_owned(), ..config(Variant::NTP) };
    assert!(matches!(refused(&other, &weights), ModelError::Vocabulary { found, .. } if found == "0011"));
    let other = ModelConfig { version: 9, ..config(Variant::NTP) };
    assert!(matches!(refused(&other, &weights), ModelError::Version { found: 9, .. }));
    let other = ModelConfig { variant: Variant::NTP_PAPER, ..config(Variant::NTP) };
    let problem = "network is object_centric; allowed: widths of the variant's encoder";
    assert!(
        matches!(refused(&other, &weights), ModelError::Config { problem: found, .. } if found.to_string() == problem)
    );
    assert!(matches!(refused(&config(Variant::NTP_PAPER), &weights), ModelError::Weights { .. }));
    assert!(matches!(refused(&config(Variant::NTP), &weights[..weights.len() / 2]), ModelError::Weights { .. }));
    assert!(matches!(refused(&config(Variant::NTP), b"no tensors"), ModelError::Weights { .. }));
    let eleven = ModelConfig { n_slots: 11, ..config(Variant::NTP_PAPER) };
    let flat = weights_to_bytes(&flattened(0), folder.path()).unwrap();
    assert!(matches!(refused(&eleven, &flat), ModelError::Weights { .. }));
    let error = check_purpose(&eleven, &config(Variant::NTP_PAPER), folder.path()).unwrap_err();
    assert!(matches!(error, ModelError::Purpose { field: "n_slots", .. }), "{error}");
}

/// Queries of several programs on two demonstrations.
fn queries() -> Vec<Query> {
    let specification = |blocks: &[u16]| {
        let task = tower("t", blocks, Split::Seen);
        std::sync::Arc::new(Specification::of(&demonstration(&task, &trial(&task, 0, 1), 0)))
    };
    let specifications = [specification(&[0, 1, 2, 3]), specification(&[4, 5])];
    let programs = [Program::BlockStacking, Program::PickAndPlace, Program::Pick, Program::Place];
    let query = |(episode, program): (usize, Program)| {
        let specification = &specifications[episode % 2];
        let parts = [specification.whole(), Span { begin: 1, end: 4 }, Span { begin: 2, end: 3 }];
        let window = parts[episode % parts.len()];
        let row = rows(1, 8, episode as u64);
        let slots_m = row[..24].chunks_exact(3).map(|position| [position[0], position[1], position[2]]).collect();
        Query {
            episode,
            decision: 0,
            depth: 0,
            step: 0,
            specification: std::sync::Arc::clone(specification),
            window,
            program,
            observation: Observation { slots_m, closed: row[25] > 0.5 },
            seen: Default::default(),
            allowed: None,
        }
    };
    (0..24).map(|episode| query((episode, programs[episode % 4]))).collect()
}

fn check_lawful(query: &Query, decision: &Decision, scoping: ScopingKind) {
    assert!(query.window.contains(decision.scope) && !decision.scope.is_empty());
    assert_eq!(decision.argument.is_some(), decision.program == Program::MoveTo);
    assert!(decision.program != Program::None || decision.end_of_program);
    let is_scoped = scoping.has_scopes() && decision.program.is_composite();
    assert!(is_scoped || decision.scope == query.window);
    assert!(scoping != ScopingKind::Primitives || !decision.program.is_composite());
    let prediction = decision.prediction.as_ref().unwrap();
    let n_frames = if is_scoped { query.window.len() } else { 0 };
    assert_eq!([prediction.start_probabilities.len(), prediction.stop_probabilities.len()], [n_frames; 2]);
    assert!((0.0..=1.0).contains(&prediction.end_probability));
}

struct Lawful;

impl NetworkUse for Lawful {
    type Output = ();

    fn run<N: Network>(self, network: N) {
        let queries = queries();
        let mut policy = LearnedPolicy::new("any", network, Decoder::Mss);
        let scoping = policy.scoping();
        for (query, decision) in queries.iter().zip(policy.decide(&queries).unwrap()) {
            check_lawful(query, &decision, scoping);
        }
    }
}

#[test]
fn decisions_are_lawful_whatever_the_weights() {
    for seed in 0..10 {
        for variant in Variant::every().filter(|variant| !variant.sees()) {
            with_network(&config(variant), Seed(seed), &device(), Lawful).unwrap();
        }
    }
}

#[test]
fn a_policy_answers_with_what_is_allowed_whatever_the_weights() {
    let query = queries().swap_remove(0);
    let n_frames = query.specification.whole().end;
    let ask = |seed: u64, programs: Vec<Program>, not_argument: Option<SlotIndex>| {
        let allowed = Allowed { programs, begin: 1, lasts: vec![2, n_frames - 1, n_frames + 7], not_argument };
        let window = query.specification.whole();
        let query = Query { window, allowed: Some(allowed), ..query.clone() };
        let mut policy = LearnedPolicy::new("ntp", object_centric(seed), Decoder::Mss);
        policy.decide(&[query]).unwrap().swap_remove(0)
    };
    for seed in 0..10 {
        let decision = ask(seed, vec![Program::Pick, Program::Place], None);
        assert!([Program::Pick, Program::Place].contains(&decision.program));
        assert_eq!(decision.scope.begin, 1);
        assert!([2, n_frames - 1].contains(&decision.scope.last()), "{:?}", decision.scope);
        let chosen = ask(seed, vec![Program::MoveTo], None).argument;
        let other = ask(seed, vec![Program::MoveTo], chosen).argument;
        assert!(chosen.is_some() && other.is_some() && other != chosen);
        assert_eq!(ask(seed, vec![Program::None], None).program, Program::None);
    }
}

#[test]
fn a_decision_does_not_depend_on_its_company() {
    let queries = queries();
    let mut policy = LearnedPolicy::new("ntp", object_centric(4), Decoder::Argmax);
    let together = policy.decide(&queries).unwrap();
    let mut reversed = policy.decide(&queries.iter().rev().cloned().collect::<Vec<_>>()).unwrap();
    reversed.reverse();
    let alone: Vec<Decision> =
        queries.iter().flat_map(|query| policy.decide(std::slice::from_ref(query)).unwrap()).collect();
    assert_eq!(together, reversed);
    assert_eq!(together, alone);
}

/// The end probability of the same query: first in a call, after another step of the call, and after a callee ran in
/// between.
#[test]
fn a_recurrent_policy_remembers_a_call_until_it_returns() {
    let mut policy = LearnedPolicy::new("ntp_gru", recurrent(3), Decoder::Mss);
    let first = queries().swap_remove(0);
    let mut ask = |depth: u8, step: u16| {
        let query = Query { depth, step, ..first.clone() };
        policy.decide(&[query]).unwrap()[0].prediction.as_ref().unwrap().end_probability
    };
    let fresh = ask(0, 0);
    let callee = ask(1, 0);
    assert_eq!(callee, fresh, "a callee remembers nothing of its caller");
    let second = ask(0, 1);
    assert_ne!(second, fresh, "a call remembers its first step");
    assert_eq!(ask(0, 0), fresh, "a new call remembers nothing");
    assert_eq!(ask(1, 0), fresh);
    assert_eq!(ask(0, 1), second, "what a callee remembers is not its caller's");
    assert_eq!(ask(1, 1), fresh, "what had returned is forgotten");
}

/// Moves all parameters beyond what can be counted with: sums of their products are no numbers.
struct Overflowing;

impl burn::module::ModuleMapper for Overflowing {
    fn map_float<const D: usize>(
        &mut self,
        parameter: burn::module::Param<Tensor<D>>,
    ) -> burn::module::Param<Tensor<D>> {
        parameter.map(|values| values * 0.0 + 1e38)
    }
}

#[test]
fn a_policy_decides_nothing_by_what_is_no_number() {
    use burn::module::Module as _;
    let mut policy = LearnedPolicy::new("ntp", object_centric(4).map(&mut Overflowing), Decoder::Mss);
    let error = policy.decide(&queries()).unwrap_err().to_string();
    assert!(error.starts_with("policy ntp cannot decide in task t: the network says"), "{error}");
    assert!(error.ends_with("allowed: finite numbers"), "{error}");
}

#[test]
fn a_network_refuses_what_another_reads() {
    let (network, all) = (object_centric(1), rows(3, 8, 4));
    let pictures = SpecificationRows::Pictures(vec![Default::default(); 3]);
    let of_pictures = Windows::new(8, &[&pictures]).unwrap();
    let refused = network.demonstration(&of_pictures, &()).unwrap_err();
    assert_eq!(refused, ReadError::Form { found: "video", allowed: "trajectories" });
    let demonstration = network.demonstration(&windows(8, &[&all]), &()).unwrap();
    let seen = States::Pictures(vec![Default::default()]);
    let refused = network.read(&demonstration, &seen, &(), &[CalledWith::default()]).unwrap_err();
    assert_eq!(refused.to_string(), "the network was given pictures; allowed: observations");
    let observations = SpecificationRows::Observations(ObservationRows::new(8, all));
    assert!(Windows::new(8, &[&observations, &pictures]).is_err(), "windows of one batch are of one form");
}
