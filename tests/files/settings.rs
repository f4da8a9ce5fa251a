//! Tests the range of every knob, and that its value survives a settings file.

use hbao::settings::{Attenuation, KNOBS, Method, Radius, Settings, Snap, Toggle};

#[test]
fn defaults_are_in_range_and_survive_a_settings_file() {
    let settings = Settings { bias: 30f64.to_radians(), blur_depth_sigma: Some(0.125), ..Settings::default() };
    settings.validate().unwrap();
    let mut read = Settings::default();
    read.read_toml(&settings.to_toml().to_string()).unwrap();
    assert_eq!(read, settings);
    assert_eq!(KNOBS.iter().find(|k| k.name == "bias").unwrap().text(&settings), "30.0");
}

#[test]
fn a_value_out_of_range_is_refused_with_its_range() {
    for (name, bad) in [
        ("directions", "0"),
        ("directions", "65"),
        ("steps", "257"),
        ("steps", "1.5"),
        ("bias", "-1"),
        ("bias", "89.5"),
        ("bias", "nan"),
        ("radius", "0"),
        ("radius", "inf"),
        ("radius", "-3%"),
        ("strength", "nan"),
        ("blur", "4"),
        ("blur", "1"),
        ("blur", "43"),
        ("blur-depth-sigma", "0"),
        ("snap", "steps"),
        ("method", "hbao-views"),
        ("spacing", "0.9"),
        ("spacing", "4.1"),
        ("spacing", "nan"),
        ("zenith", "z"),
        ("quadrature", "simpson"),
        ("msaa", "3"),
        ("msaa", "0"),
        ("ssao-samples", "12"),
        ("half-res", "yes"),
    ] {
        let knob = KNOBS.iter().find(|knob| knob.name == name).unwrap();
        let error = knob.set(&mut Settings::default(), bad).unwrap_err();
        assert!(error.is_usage());
        assert!(error.to_string().starts_with(&format!("{name}: '{bad}' is n")), "{error}");
    }
    let settings = Settings { directions: 65, ..Settings::default() };
    assert!(settings.validate().unwrap_err().to_string().contains("from 1 to 64"));
}

#[test]
fn a_settings_file_with_an_unknown_key_or_no_toml_says_which_line_or_key() {
    let mut settings = Settings::default();
    assert!(settings.read_toml("radios = 3").unwrap_err().starts_with("line 1: unknown setting 'radios'"));
    for (text, start) in [
        ("steps = 3\n\n# more\nbias = 90", "line 4: bias: '90' is not an angle"),
        ("steps = 3\r\n'radios' = 3\r\n", "line 2: unknown setting 'radios'"),
        ("text = \"\"\"\nsteps\n\"\"\"\nsteps = 0", "line 1: unknown setting 'text'"),
        ("steps = [\n1,\n2]", "line 1: steps: the value is of the type array"),
        ("\n\n[render]\nsteps = 0\n[other]", "line 5: unknown setting 'other'"),
    ] {
        let error = settings.read_toml(text).unwrap_err();
        assert!(error.starts_with(start), "{text:?}: {error}");
    }
    assert!(settings.read_toml("steps = 3\nradius = = 4").unwrap_err().starts_with("line 2: "));
    settings.read_toml("radius = '2%'\n[render]\neye = 3").unwrap();
    assert_eq!(settings.radius, Radius::Percent(2.0));
}

#[test]
fn the_curve_of_ssao_is_off_with_normals_and_a_value_that_is_given_wins() {
    let read = |text: &str| {
        let mut settings = Settings::default();
        settings.read_toml(text).unwrap();
        let mut again = Settings::default();
        again.read_toml(&settings.to_toml()).unwrap();
        assert_eq!(again, settings);
        settings.curve()
    };
    assert_eq!(read("ssao-normals = 'off'"), Toggle::On);
    assert_eq!(read("ssao-normals = 'on'"), Toggle::Off);
    for (given, curve) in [("on", Toggle::On), ("off", Toggle::Off)] {
        for normals in ["on", "off"] {
            assert_eq!(read(&format!("ssao-curve = '{given}'\nssao-normals = '{normals}'")), curve);
            assert_eq!(read(&format!("ssao-normals = '{normals}'\nssao-curve = '{given}'")), curve);
        }
    }
    for method in Method::ALL {
        assert_eq!(Settings::for_method(*method).curve(), Toggle::On);
        assert_eq!(Settings { ssao_normals: Toggle::On, ..Settings::for_method(*method) }.curve(), Toggle::Off);
    }
    Settings { ssao_normals: Toggle::On, ..Settings::default() }.validate().unwrap();
}

#[test]
fn the_talk_brings_its_own_attenuation_and_snapping() {
    let talk = Settings::for_method(Method::HbaoTalk);
    assert_eq!((talk.attenuation, talk.snap), (Attenuation::Linear, Snap::Sample));
    let chapter = Settings::for_method(Method::Hbao);
    assert_eq!(chapter, Settings::default());
}
