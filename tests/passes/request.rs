//! A pipeline makes only what its request asks for.

use crate::rig::{faults, scenes};
use hbao::context::{Backend, Context};
use hbao::settings::Radius;
use hbao::{Apply, Error, Pipeline, Request, Settings};

#[test]
fn colour_is_drawn_and_resolved_only_if_an_image_needs_it() {
    const SIZE: (u32, u32) = (33, 21);
    let context = Context::open(Backend::Osmesa).unwrap();
    let gl = faults::refusing(&context);
    let shot = scenes::box_on_a_floor();
    let settings = Settings { radius: Radius::Units(0.8), msaa: 4, directions: 4, steps: 2, ..Settings::default() };
    // Renders with a request, and returns the pipeline, the number of multisample textures, and whether the shaders
    // were given a colour or a light.
    let render = |request: Request| {
        let (pipeline, told) = faults::run(&gl, None, || {
            let mut pipeline = Pipeline::new(&gl, SIZE, &settings, request).unwrap();
            pipeline.render(&shot.mesh, &shot.camera(SIZE)).unwrap();
            pipeline
        });
        (pipeline, told.calls["glTexImage2DMultisample"], told.calls.contains_key("glUniform3f"))
    };
    let plain = Request { raw: true, edges: true, ..Request::default() };
    let (with, textures, shaded) = render(Request { colour: true, ..plain });
    assert!(textures == 3 && shaded, "{textures}");
    let (without, textures, shaded) = render(plain);
    assert!(textures == 2 && !shaded, "{textures}");

    assert_eq!(with.depth_samples().unwrap(), without.depth_samples().unwrap());
    assert_eq!(with.normals().unwrap(), without.normals().unwrap());
    assert_eq!((with.ao_raw(), with.edges()), (without.ao_raw(), without.edges()));
    assert_eq!(with.ao().unwrap(), without.ao().unwrap());
    assert!(matches!(without.colour(), Err(Error::Usage(what)) if what.contains("keeps no colour")));

    // The final image needs the colour, unless it is not made.
    let (last, ..) = render(Request { composite: Some(Apply::All), ..Request::default() });
    assert_eq!(last.colour().unwrap(), with.colour().unwrap());
    let (none, ..) = render(Request { composite: Some(Apply::All), gbuffer_only: true, ..Request::default() });
    assert!(none.colour().is_err());
    let (only, ..) = render(Request { gbuffer_only: true, colour: true, ..Request::default() });
    assert_eq!(only.colour().unwrap(), with.colour().unwrap());
}
