//! `zsim scene`: view, plan and export.

use crate::command::run;

#[test]
fn a_plan_shows_the_cut_walls_and_the_route() {
    let here = tempfile::tempdir().unwrap();
    let (code, out, errors) = run(here.path(), "scene plan office office.svg --height 150cm");
    assert_eq!((code, out.lines().last()), (0, Some("office.svg")), "{errors}");
    let svg = std::fs::read_to_string(here.path().join("office.svg")).unwrap();
    for text in ["cut at z = 1.5 m", "Elevation", "x (m)", "z (m)", "default route", "start"] {
        assert!(svg.contains(text), "{text}");
    }
    let (_, _, errors) = run(here.path(), "scene plan office high.svg --height 100m");
    assert_eq!(errors, "", "a cut above the scene shows the scene from above");
    assert!(std::fs::read_to_string(here.path().join("high.svg")).unwrap().contains("cut at z = 100.0 m"));
}

#[test]
fn the_file_is_replaced_only_with_force_and_its_ending_must_be_known() {
    let here = tempfile::tempdir().unwrap();
    for (command, file) in [("view", "box.html"), ("plan", "box.svg"), ("export", "box.glb"), ("export", "box.STL")] {
        std::fs::write(here.path().join(file), "mine").unwrap();
        let (code, _, errors) = run(here.path(), &format!("scene {command} mocap_room {file}"));
        assert!(code == 1 && errors.contains(&format!("{file} exists: pass --force")), "{errors}");
        assert_eq!(std::fs::read(here.path().join(file)).unwrap(), b"mine");
        let other = file.replace('.', "-other.");
        assert_eq!(run(here.path(), &format!("scene {command} mocap_room {other}")).0, 0);
        let (code, out, errors) = run(here.path(), &format!("scene {command} mocap_room {file} --force"));
        assert_eq!((code, out.lines().last()), (0, Some(file)), "{errors}");
        let [first, second] = [file, &other].map(|name| std::fs::read(here.path().join(name)).unwrap());
        assert!(first == second && first.len() > 1000, "{file}: the same bytes each time");
        let (code, _, errors) = run(here.path(), &format!("scene {command} mocap_room box.txt"));
        assert!(code == 2 && errors.contains("must end in ."), "{errors}");
    }
}

#[test]
fn an_export_does_not_replace_its_scene() {
    let here = tempfile::tempdir().unwrap();
    let scene = "(name: \"s\", materials: {\"a\": (reflectance: 0.5)}, items: [\n\
                 Solid(shape: Mesh(file: \"wall.obj\"), material: \"a\"),\n])";
    let wall = "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n";
    std::fs::write(here.path().join("wall.obj"), wall).unwrap();
    std::fs::write(here.path().join("scene.ron"), scene).unwrap();
    let (code, _, errors) = run(here.path(), "scene export scene.ron wall.obj --force");
    assert!(code == 2 && errors.contains("would be replaced"), "{code} {errors}");
    assert_eq!(std::fs::read_to_string(here.path().join("wall.obj")).unwrap(), wall);
}
