use crate::dynamics::heads::{ReferenceHead, built, cord, floating, jointed, moored, suspended};

/// The error of the reference head with one replacement in its text.
fn error_with(from: &str, to: &str) -> String {
    let text = ReferenceHead::default().text();
    assert!(text.contains(from), "the text has no {from}");
    built(&text.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn an_invalid_number_is_an_error_with_its_line() {
    let negative = error_with("mass_kg: 0.40", "mass_kg: -0.40");
    assert!(negative.starts_with("head.ron:4:") && negative.contains("above 0, found -0.4"), "{negative}");
    let nan = error_with("mass_kg: 0.40", "mass_kg: NaN");
    assert!(nan.starts_with("head.ron:4:") && nan.contains("found NaN"), "{nan}");
    let unknown = error_with("segments: 1", "segmints: 1");
    assert!(unknown.starts_with("head.ron:15:") && unknown.contains("segmints"), "{unknown}");
    let none = error_with("active_coils: 12.0", "active_coils: 0.0");
    assert!(none.contains("above 0, found 0"), "{none}");
    let damping = error_with("rocking: 0.0", "rocking: -0.1");
    assert!(damping.contains("at least 0, found -0.1"), "{damping}");
}

#[test]
fn an_inertia_that_no_rigid_body_can_have_is_refused() {
    // zz > xx + yy violates the triangle inequality of principal moments.
    let error = error_with("zz: 4e-4", "zz: 4e-3");
    assert!(error.starts_with("head.ron:6:") && error.contains("at most the sum of the other two"), "{error}");
    let error = error_with("zz: 4e-4", "zz: 4e-4, xy: 2e-3");
    assert!(error.contains("principal moments"), "{error}");
}

#[test]
fn the_error_of_an_unstable_head_has_its_largest_stable_mass() {
    // A spring of 25/2.0/10/100 mm is unstable under 0.40 kg.
    let text = ReferenceHead { coil: [25.0, 2.0, 10.0, 100.0], ..ReferenceHead::default() }.text();
    let error = built(&text).unwrap_err().to_string();
    assert!(error.contains("cannot stand") && error.contains("the head has 0.400 kg"), "{error}");
    let largest_kg: f64 = error.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    // A head slightly lighter than the stated mass is stable, a slightly heavier one is not.
    let with_mass = |mass_kg: f64| {
        // The same load distribution: the centre of mass is unchanged, and inertia does not affect statics.
        built(&text.replacen("mass_kg: 0.40", &format!("mass_kg: {mass_kg}"), 1))
    };
    assert!(largest_kg > 0.05 && largest_kg < 0.4, "{largest_kg}");
    assert!(with_mass(largest_kg * 0.99).is_ok());
    assert!(with_mass(largest_kg * 1.01).is_err());
}

#[test]
fn invalid_springs_are_refused() {
    let coil =
        |coil: [f64; 4]| built(&ReferenceHead { coil, ..ReferenceHead::default() }.text()).unwrap_err().to_string();
    assert!(coil([25.0, 14.0, 2.0, 120.0]).contains("spring index"), "{}", coil([25.0, 14.0, 2.0, 120.0]));
    assert!(coil([25.0, 3.0, 41.0, 120.0]).contains("coils"), "{}", coil([25.0, 3.0, 41.0, 120.0]));
    let pieces = error_with("segments: 1", "segments: 0");
    assert!(pieces.starts_with("head.ron:") && pieces.contains("1 to 64 segments, not 0"), "{pieces}");
    let text = ReferenceHead::default().text();
    let from = text.find("coil(").unwrap();
    let to = text.find("segments").unwrap();
    let named = built(&format!("{}named(\"no_such\"), {}", &text[..from], &text[to..])).unwrap_err().to_string();
    assert!(named.contains("no such spring"), "{named}");
    let given = |diagonal: &str, segments: usize| {
        let rows: Vec<String> = (0..6)
            .map(|i| {
                let row: Vec<String> = (0..6)
                    .map(|j| if i == j { diagonal.split(' ').nth(i).unwrap().to_owned() } else { "0.0".to_owned() })
                    .collect();
                format!("({})", row.join(", "))
            })
            .collect();
        let spring = format!("stiffness(length_mm: 100.0, rows: ({})), ", rows.join(", "));
        built(&format!(
            "{}{spring}{}",
            &text[..from],
            &text[to..].replace("segments: 1", &format!("segments: {segments}"))
        ))
    };
    assert!(given("400.0 400.0 4000.0 5.0 5.0 0.8", 1).is_ok());
    let soft = given("400.0 400.0 4000.0 5.0 -5.0 0.8", 1).unwrap_err().to_string();
    assert!(soft.starts_with("head.ron:") && soft.contains("not positive definite"), "{soft}");
    let cut = given("400.0 400.0 4000.0 5.0 5.0 0.8", 2).unwrap_err().to_string();
    assert!(cut.contains("only a coil can be divided"), "{cut}");
}

#[test]
fn an_end_stop_in_contact_at_rest_is_refused() {
    let stop = "end_stop: (angle_deg: 175.0, stiffness_nm_per_rad: 20.0, damping_nm_s_per_rad: 0.02),";
    let error = built(&ReferenceHead { more: stop, ..ReferenceHead::default() }.text()).unwrap_err().to_string();
    assert!(error.starts_with("head.ron:19:") && error.contains("below 170"), "{error}");
}

/// The error of a suspension.
fn refused(place: [f64; 3], elements: &str) -> String {
    built(&suspended(place, elements)).unwrap_err().to_string()
}

#[test]
fn invalid_suspensions_are_errors_with_the_reason() {
    let none = refused([0.0; 3], "");
    assert!(none.starts_with("head.ron:") && none.contains("at least one element"), "{none}");
    let rope = |x: f64| cord([x, 0.0, 0.0], [x, 0.0, 0.05], 0.4, 800.0);
    let zero = refused([0.0; 3], &rope(0.0).replace("length_m: 0.4", "length_m: 0.0"));
    assert!(zero.starts_with("head.ron:") && zero.contains("above 0, found 0"), "{zero}");
    // A single rope does not constrain the rotation about itself.
    let loose = refused([0.0, 0.0, -0.45], &rope(0.0));
    assert!(loose.contains("resists a turn about z"), "{loose}");
    // Ropes cannot push: the head falls to a pose below them.
    let above = refused([0.0, 0.0, 0.45], &(rope(0.03) + &rope(-0.03)));
    assert!(above.contains("away from base_from_head"), "{above}");
    let joints = refused([0.0, 0.0, 0.07], &jointed(0.7).repeat(2));
    assert!(joints.contains("at most one universal_joint"), "{joints}");
    // 0.40 kg at 70 mm above a joint need 0.27 N m/rad.
    let falls = refused([0.0, 0.0, 0.07], &jointed(0.2));
    assert!(falls.contains("cannot stand on the elements") && falls.contains("they support at most"), "{falls}");
    // A cylinder of 1.2 litres does not carry it in a fluid of a third of water's density.
    let sinks = floating([0.0; 4]).replace("density_kg_per_m3: 1000.0", "density_kg_per_m3: 300.0");
    let sinks = refused([0.0, 0.0, 0.05], &(sinks + &moored()));
    assert!(sinks.contains("cannot stand") && sinks.contains("they support at most 0."), "{sinks}");
}

#[test]
fn invalid_wires_and_cables_are_refused() {
    let cable = "cable: (length_m: 0.1, tension_n: 50.0, stiffness_n_per_m: 400.0, damping_n_s_per_m: 0.0),";
    let error = built(&ReferenceHead { more: cable, ..ReferenceHead::default() }.text()).unwrap_err().to_string();
    assert!(error.starts_with("head.ron:") && error.contains("-0.025 m long without tension"), "{error}");
    let text = ReferenceHead { more: "spring_mass: included,", ..ReferenceHead::default() }.text();
    let unknown = text.replace("spring_steel", "moduli(youngs_gpa: 206.0, shear_gpa: 79.3)");
    let error = built(&unknown).unwrap_err().to_string();
    assert!(error.contains("density_kg_per_m3"), "{error}");
    let known = text.replace("spring_steel", "moduli(youngs_gpa: 206.0, shear_gpa: 79.3, density_kg_per_m3: 7850.0)");
    assert_eq!(built(&known).unwrap().linear_modes(), built(&text).unwrap().linear_modes());
}

#[test]
fn an_invalid_carrier_is_an_error_with_its_line() {
    let with = |carrier: &str| {
        let text = ReferenceHead::default().text();
        let (body, _) = text.rsplit_once(')').unwrap();
        built(&format!("{body}    carrier: [\n        ({carrier}),\n    ],\n)"))
    };
    // The head is on a spring of 120 mm, with its laser 100 mm higher.
    let around = "name: \"post\", foot_in_base_m: (0.0, 0.0, 0.2), radius_m: 0.05, height_m: 0.1, reflectance: 0.5";
    let error_of = |from: &str, to: &str| {
        assert!(around.contains(from), "{from}");
        with(&around.replacen(from, to, 1)).unwrap_err().to_string()
    };
    assert!(with(&around.replacen("0.2)", "0.3)", 1)).is_ok());
    assert!(with(&around.replacen("radius_m: 0.05", "radius_m: 1e-9", 1).replacen("(0.0,", "(0.1,", 1)).is_ok());
    let inside = with(around).unwrap_err().to_string();
    assert!(inside.starts_with("head.ron:22:") && inside.contains("inside the carrier's `post`"), "{inside}");
    for (from, to, part) in [
        ("radius_m: 0.05", "radius_m: -0.05", "above 0, found -0.05"),
        ("height_m: 0.1", "height_m: inf", "found inf"),
        ("reflectance: 0.5", "reflectance: 1.5", "from 0 to 1, found 1.5"),
        ("foot_in_base_m: (0.0,", "foot_in_base_m: (NaN,", "NaN"),
        ("radius_m: 0.05", "radios_m: 0.05", "radios_m"),
    ] {
        let error = error_of(from, to);
        assert!(error.starts_with("head.ron:22:") && error.contains(part), "{to}: {error}");
    }
}
