//! Variants: the parts that a name stands for, and combinations that have no name.

use ntp::model::{CoreKind, EncoderKind, ModelConfig, ScopingKind, Variant};
use ntp::pipeline::{ModelSpec, PipelineFile};
use ntp::task::Family;
use ntp::trace::SpecificationForm;
use serde_json::{from_value, json, to_value};

fn unnamed() -> Variant {
    Variant::of(CoreKind::Gru, ScopingKind::Unscoped, EncoderKind::Flattened).unwrap()
}

#[test]
fn a_name_stands_for_its_parts() {
    let parts = |name: &str| {
        let variant: Variant = name.parse().unwrap();
        (variant.core(), variant.scoping(), variant.encoder())
    };
    assert_eq!(parts("ntp"), (CoreKind::Reactive, ScopingKind::Scoped, EncoderKind::ObjectCentric));
    assert_eq!(parts("flat_gru_paper"), (CoreKind::Gru, ScopingKind::Primitives, EncoderKind::Flattened));
    assert_eq!(parts("npi"), (CoreKind::Lstm, ScopingKind::Arguments, EncoderKind::ObjectCentric));
    assert_eq!(parts("ntp_vid_e2e_general"), (CoreKind::Reactive, ScopingKind::Scoped, EncoderKind::Keypoints));
    assert_eq!(Variant::default(), Variant::NTP);
}

#[test]
fn names_differ_and_find_their_variant_again() {
    let every: Vec<Variant> = Variant::every().collect();
    // Two encoders of positions with nine networks each and the ancestor's, three end to end with three each, two
    // behind detectors with nine each.
    assert_eq!(every.len(), 2 * 10 + 3 * 3 + 2 * 9);
    assert_eq!(Variant::named().count(), 17);
    assert!(Variant::named().all(|variant| every.contains(&variant)));
    for variant in every {
        assert_eq!(variant.name().parse(), Ok(variant));
        assert_eq!(from_value::<Variant>(to_value(variant).unwrap()).unwrap(), variant);
    }
}

#[test]
fn files_hold_a_name_where_there_is_one_and_parts_where_there_is_none() {
    assert_eq!(to_value(Variant::NTP_GRU_PAPER).unwrap(), json!("ntp_gru_paper"));
    let parts = json!({ "core": "gru", "scoping": "unscoped", "encoder": "flattened" });
    assert_eq!(to_value(unnamed()).unwrap(), parts);
    assert_eq!(from_value::<Variant>(parts).unwrap(), unnamed());
    assert_eq!(unnamed().name(), "gru_unscoped_flattened");
    let by_parts: Variant = from_value(json!({ "core": "gru", "encoder": "flattened" })).unwrap();
    assert_eq!(by_parts, Variant::NTP_GRU_PAPER, "what is left out is NTP's");
}

#[test]
fn a_variant_that_cannot_be_is_refused_with_what_is_allowed() {
    let refused = |value| from_value::<Variant>(value).unwrap_err().to_string();
    let unknown = refused(json!("ntp_big"));
    assert!(unknown.starts_with("unknown variant `ntp_big`, expected one of `ntp`, `ntp_paper`"), "{unknown}");
    assert_eq!(
        refused(json!({ "scoping": "arguments" })),
        "core reactive with scoping arguments and encoder object_centric; allowed: scoping arguments with core lstm and \
         encoder object_centric or flattened"
    );
    assert_eq!(
        refused(json!({ "core": "gru", "encoder": "keypoints" })),
        "core gru with scoping scoped and encoder keypoints; allowed: core reactive with encoders that learn from \
         pictures end to end"
    );
    let misspelt = refused(json!({ "kernel": "gru" }));
    assert!(misspelt.contains("unknown field `kernel`, expected one of `core`, `scoping`, `encoder`"), "{misspelt}");
}

#[test]
fn a_model_s_configuration_is_of_its_variant_whatever_has_a_name() {
    for variant in Variant::every() {
        let form = variant.specification(SpecificationForm::default());
        let mut config = ModelConfig::new(variant, form, Family::BlockStacking, 8, json!(null));
        config.network = config.network.for_pictures(64, 1, 8);
        assert_eq!(config.check(), Ok(()), "{variant}");
        let again: ModelConfig = from_value(to_value(&config).unwrap()).unwrap();
        assert_eq!(again, config);
    }
}

#[test]
fn a_pipeline_file_names_a_variant_or_its_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.toml");
    #[expect(clippy::result_large_err, reason = "tests look at the error")]
    let load = |variant: &str| {
        let text = format!(
            "name = \"parts\"\n[tasks]\nfamily = \"block_stacking\"\ntrain = 3\n[[models]]\nvariant = {variant}\n"
        );
        std::fs::write(&path, text).unwrap();
        PipelineFile::load(&path)
    };
    let model = |variant: &str| -> ModelSpec {
        match load(variant).unwrap() {
            PipelineFile::Experiment(pipeline) => pipeline.spec.models[0].clone(),
            PipelineFile::Study(_) => panic!("a study"),
        }
    };
    let parts = model("{ core = \"gru\", scoping = \"unscoped\", encoder = \"flattened\" }");
    assert_eq!(parts.variant, unnamed());
    assert_eq!((parts.core().name(), parts.scoping().name(), parts.encoder().name()), ("gru", "unscoped", "flattened"));
    assert_eq!(model("\"ntp_paper\"").variant, Variant::NTP_PAPER);
    let refused = load("{ core = \"gru\", encoder = \"convolved\" }").unwrap_err().to_string();
    assert!(refused.contains("parts.toml") && refused.contains("allowed: core reactive"), "{refused}");
}
