//! A frame allocates no memory once two frames like it have been rendered. This test counts, with an allocator of its
//! own, what the library and glow allocate; drivers have allocators of theirs.

mod rig;

use hbao::context::{Backend, Context};
use hbao::settings::{Method, SsaoDepth};
use hbao::{
    AmbientOcclusion, DepthEncoding, Destination, Hand, Inputs, NormalEncoding, NormalSpace, Output, Settings,
    TextureTarget, Write,
};
use rig::by_hand::{Textures, perspective, rubble};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Counts the allocations of each thread.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are those of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: as above.
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Returns how often this thread allocates in a call.
fn allocations(run: impl FnOnce()) -> usize {
    let before = COUNT.get();
    run();
    COUNT.get() - before
}

#[test]
fn allocations_are_counted() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1);
    assert_eq!(allocations(|| ()), 0);
}

#[test]
fn a_third_frame_of_16x16_allocates_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (16, 16);
    let view = rubble(size, perspective(60.0, size), 5, 1.0..2.0);
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let linear = textures.inputs;
    // As an engine has them: hardware depth, whose place linear depth takes here, and no normals, or those of another
    // space.
    let encoded = Inputs { depth_encoding: DepthEncoding::reversed(0.1, f64::INFINITY), normals: None, ..linear };
    let world = Inputs { normal_space: NormalSpace::Eye(Hand::Right), ..linear };
    for method in rig::methods() {
        for half_res in [false, true] {
            let ssao_depth = if half_res { SsaoDepth::Half } else { SsaoDepth::Full };
            let settings = Settings { half_res, ssao_depth, blur: 9, ..rig::raw(method, 1.0) };
            let mut ao = AmbientOcclusion::new(context.gl().clone(), size, &settings).unwrap();
            for inputs in [linear, encoded, world] {
                let text = format!("{} {half_res}", method.name());
                let mut frame = |text: &str| {
                    ao.render(&inputs).unwrap_or_else(|error| panic!("{text}: {error}"));
                };
                (0..2).for_each(|_| frame(&text));
                assert_eq!(allocations(|| frame(&text)), 0, "{text}");
            }
        }
    }
}

#[test]
fn a_frame_that_is_written_to_an_image_allocates_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (16, 16);
    let view = rubble(size, perspective(60.0, size), 5, 1.0..2.0);
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let [other, shares] =
        [(); 2].map(|()| Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed));
    let [to, shares] = [&other, &shares].map(|textures| textures.inputs.normals.unwrap());
    let mut ao = AmbientOcclusion::new(context.gl().clone(), size, &rig::raw(Method::Hbao, 1.0)).unwrap();
    for write in [Write::Visibility, Write::Multiplied(1.0), Write::MultipliedByShare(shares)] {
        let output = Output::new(Destination::Texture(to), write);
        let mut frame = || ao.render_into(&textures.inputs, &output).unwrap();
        (0..2).for_each(|_| frame());
        assert_eq!(allocations(frame), 0, "{write:?}");
    }
}
