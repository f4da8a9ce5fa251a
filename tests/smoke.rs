use hbao::context::*;
use hbao::reference as r;
use hbao::scene::*;
use hbao::settings::*;
use hbao::*;
#[test]
fn smoke() {
    let args: Vec<String> =
        std::env::var("S").unwrap_or("cornell-box".into()).split_whitespace().map(String::from).collect();
    let ctx = Context::open(Backend::Auto).unwrap();
    println!("{}", ctx.describe());
    let scene = Scene::open(&args[0]).unwrap();
    let v = |s: &str| {
        let f: Vec<f64> = s.split(',').map(|x| x.parse().unwrap()).collect();
        glam::DVec3::new(f[0], f[1], f[2])
    };
    let view = if args.len() > 1 {
        View {
            eye: Some(v(&args[1])),
            target: Some(v(&args[2])),
            lens: Some(Lens::FovY(args[3].parse::<f64>().unwrap().to_radians())),
            ..Default::default()
        }
    } else {
        scene.view.clone()
    };
    let (w, h) = (args.get(4).map_or(400, |s| s.parse().unwrap()), args.get(5).map_or(300, |s| s.parse().unwrap()));
    let (camera, notes) = view.camera(&scene.mesh, w, h).unwrap();
    println!("{camera:?} {notes:?}");
    let mut settings = Settings { ao_format: AoFormat::R32f, ..Settings::default() }.resolved(scene.mesh.diagonal());
    if let Some(r) = scene.radius {
        settings.radius = Radius::Units(r);
    }
    let mut p =
        Pipeline::new(ctx.gl(), (w, h), &settings, Request { composite: Some(Apply::All), raw: true, timings: true })
            .unwrap();
    println!("{:?}", p.notices());
    for _ in 0..3 {
        let t = p.render(&scene.mesh, &camera).unwrap();
        for t in t {
            println!("{} {:?} {:.2}", t.name, t.gpu_ms, t.wall_ms);
        }
    }
    let depth = p.depth().unwrap();
    let normals = p.normals().unwrap();
    let ao = p.ao_raw().unwrap().clone();
    let blurred = p.ao().unwrap();
    let t0 = std::time::Instant::now();
    let g = r::gbuffer::gbuffer(&scene.mesh, &camera, (w as usize, h as usize), Normals::Derivative);
    println!("rays {:?}", t0.elapsed());
    let (mut cov, mut bad_cov, mut bad_d, mut bad_n) = (0, 0, 0, 0);
    let (mut de, mut ne) = (vec![], vec![]);
    for i in 0..g.texels.len() {
        let s = g.texels[i];
        let d = depth.texels[i] as f64;
        if s.depth.is_infinite() != d.is_infinite() {
            bad_cov += 1;
            continue;
        }
        if d.is_infinite() {
            continue;
        }
        cov += 1;
        let e = (d - s.depth).abs() / s.depth;
        de.push(e);
        if e > 1e-5 {
            bad_d += 1;
        }
        let n = glam::Vec3::from(normals.texels[i]).as_dvec3();
        let a = n.dot(s.normal).clamp(-1., 1.).acos().to_degrees();
        ne.push(a);
        if a > 1.0 {
            bad_n += 1;
        }
    }
    de.sort_by(f64::total_cmp);
    ne.sort_by(f64::total_cmp);
    let q = |v: &Vec<f64>, f: f64| v[((v.len() - 1) as f64 * f) as usize];
    println!(
        "covered {cov} coverage differs {bad_cov}, depth bad {:.4}% normals bad {:.4}%",
        100. * bad_d as f64 / cov as f64,
        100. * bad_n as f64 / cov as f64
    );
    for f in [0.5, 0.9, 0.99, 0.995, 0.999, 1.0] {
        println!("{f}: depth {:.2e} normal {:.3}", q(&de, f), q(&ne, f));
    }
    let tile = rotation_tile(&settings);
    let inputs = r::hbao::Inputs { depth: &depth, normals: &normals, tile: &tile, projection: camera.projection };
    let t0 = std::time::Instant::now();
    let twin = r::hbao::hbao(&inputs, &settings).unwrap();
    println!("twin {:?}", t0.elapsed());
    let amb = r::hbao::ambiguous(&inputs, &settings).unwrap();
    let mut e: Vec<f64> = (0..twin.texels.len())
        .filter(|&i| depth.texels[i].is_finite())
        .map(|i| (twin.texels[i] - ao.texels[i] as f64).abs())
        .collect();
    let over = e.iter().filter(|&&x| x > 1e-3).count();
    let over_clear = (0..twin.texels.len())
        .filter(|&i| (twin.texels[i] - ao.texels[i] as f64).abs() > 1e-3 && !amb.texels[i])
        .count();
    println!(
        "ambiguous {} over {over} over and clear {over_clear}, mean A {}",
        amb.texels.iter().filter(|&&x| x).count(),
        twin.texels.iter().sum::<f64>() / twin.texels.len() as f64
    );
    e.sort_by(f64::total_cmp);
    for f in [0.5, 0.9, 0.99, 0.999, 1.0] {
        println!("{f}: ao {:.2e}", q(&e, f));
    }
    for i in 0..twin.texels.len() {
        if (twin.texels[i] - ao.texels[i] as f64).abs() > 1e-3 {
            println!(
                "clear {} {} {} gpu {} twin {} z {} n {:?} tile {:?}",
                !amb.texels[i],
                i % w as usize,
                i / w as usize,
                ao.texels[i],
                twin.texels[i],
                depth.texels[i],
                normals.texels[i],
                tile.at(i % w as usize % 4, i / w as usize % 4)
            );
        }
    }
    let b = r::blur::blur(&ao.map(f64::from), &depth, &settings).unwrap();
    println!(
        "blur max {:.2e}",
        b.texels.iter().zip(&blurred.texels).map(|(a, b)| (a - *b as f64).abs()).fold(0., f64::max)
    );
    let g8 = |i: &image::Image<f32>| i.map(|x| (x * 255.).round() as u8);
    std::fs::write("/tmp/ao.png", image::png::encode(&g8(&blurred), &[]).unwrap()).unwrap();
    std::fs::write("/tmp/raw.png", image::png::encode(&g8(&ao), &[]).unwrap()).unwrap();
    std::fs::write("/tmp/final.png", image::png::encode(&p.composite().unwrap().unwrap(), &[]).unwrap()).unwrap();
    std::fs::write(
        "/tmp/normals.png",
        image::png::encode(&normals.map(|n| n.map(|x| ((x * 0.5 + 0.5) * 255.) as u8)), &[]).unwrap(),
    )
    .unwrap();
}
