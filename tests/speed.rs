use hbao::context::*;
use hbao::scene::*;
use hbao::*;
#[test]
fn speed() {
    let args: Vec<String> = std::env::var("S")
        .unwrap_or("../shared/models/sibenik.obj -15.5,-10.5,0 10,-9,0 60 1600 1200".into())
        .split_whitespace()
        .map(String::from)
        .collect();
    let ctx = Context::open(Backend::Auto).unwrap();
    let scene = Scene::open(&args[0]).unwrap();
    let v = |s: &str| {
        let f: Vec<f64> = s.split(',').map(|x| x.parse().unwrap()).collect();
        glam::DVec3::new(f[0], f[1], f[2])
    };
    let view = View {
        eye: Some(v(&args[1])),
        target: Some(v(&args[2])),
        lens: Some(Lens::FovY(args[3].parse::<f64>().unwrap().to_radians())),
        ..Default::default()
    };
    let (w, h) = (args[4].parse().unwrap(), args[5].parse().unwrap());
    let (camera, _) = view.camera(&scene.mesh, w, h).unwrap();
    let mut settings = Settings::default().resolved(scene.mesh.diagonal());
    if let Ok(t) = std::env::var("SET") {
        settings.read_toml(&t).unwrap();
    }
    let mut p = Pipeline::new(ctx.gl(), (w, h), &settings, Request::default()).unwrap();
    p.render(&scene.mesh, &camera).unwrap();
    let m = measure::AgainstFloor::measure(ctx.gl(), &p.inputs(&camera), (w, h), &settings, 25).unwrap();
    let f = |v: &[f64]| {
        let mut v = v.to_vec();
        v.sort_by(f64::total_cmp);
        format!("{:.1} {:.1} {:.1}", v[0], v[v.len() / 2], v[v.len() - 1])
    };
    println!(
        "MIN {:.3} ao {} | floor {} | blur {} | ratio {:.3}",
        m.ao_ms.iter().cloned().fold(9e9, f64::min) / m.floor_ms.iter().cloned().fold(9e9, f64::min),
        f(&m.ao_ms),
        f(&m.floor_ms),
        f(&m.blur_ms),
        m.ratio()
    );
}
