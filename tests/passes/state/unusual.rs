//! Sets state that no full-screen pass would expect. Every value differs from OpenGL's initial value.

use super::report::{QUERIES, Raw, Reporter, TEXTURES};
use glow::HasContext as _;

/// Sets this state. The objects that are made here are deleted together with the context.
pub(crate) fn disturb(gl: &glow::Context, reporter: &Reporter) {
    let raw = &reporter.raw;
    // SAFETY: the context is current, and nothing is drawn.
    unsafe {
        framebuffers(gl);
        textures(gl);
        switches(reporter);
        fragments(gl, raw);
        rasterisation(gl, raw);
        pixels(raw);
        buffers(gl, raw);
        program(gl);
        for (name, target) in QUERIES {
            // Only one of the two queries that count samples may be active at a time.
            if name != "ANY_SAMPLES_PASSED" {
                gl.begin_query(target, gl.create_query().unwrap());
            }
        }
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
}

/// Inverts every switch. `fragments` then changes those of single draw buffers.
unsafe fn switches(reporter: &Reporter) {
    for &(_, switch) in &reporter.switches {
        // SAFETY: the context is current in all of this file.
        unsafe {
            match (reporter.raw.is_enabled)(switch) {
                0 => (reporter.raw.enable)(switch),
                _ => (reporter.raw.disable)(switch),
            }
        }
    }
}

unsafe fn fragments(gl: &glow::Context, raw: &Raw) {
    // SAFETY: as above.
    unsafe {
        for buffer in 0..8 {
            // Nothing is written to the first buffer, and no two neighbouring buffers have the same mask.
            let mask = |bit: u32| u8::from((buffer + 1) >> bit & 1 == 0 && buffer > 0);
            (raw.color_mask)(buffer, mask(0), mask(1), mask(2), 0);
            if buffer % 3 == 1 {
                gl.disable_draw_buffer(glow::BLEND, buffer);
            }
        }
        gl.blend_color(0.1, 0.2, 0.3, 0.4);
        gl.blend_func_separate(glow::DST_COLOR, glow::SRC_ALPHA, glow::ZERO, glow::CONSTANT_ALPHA);
        gl.blend_equation_separate(glow::FUNC_REVERSE_SUBTRACT, glow::MAX);
        (raw.logic_op)(glow::XOR);
        gl.depth_mask(false);
        gl.depth_func(glow::NEVER);
        gl.sample_coverage(0.0, true);
        (raw.sample_mask)(0, 0);
        gl.scissor(1, 2, 3, 4);
        gl.clear_color(0.2, 0.4, 0.6, 0.8);
        gl.clear_depth_f64(0.3);
        gl.clear_stencil(77);
        gl.stencil_func_separate(glow::FRONT, glow::NEVER, 3, 0x0f);
        gl.stencil_func_separate(glow::BACK, glow::GEQUAL, 5, 0xf0);
        gl.stencil_op_separate(glow::FRONT, glow::INVERT, glow::INCR, glow::DECR_WRAP);
        gl.stencil_op_separate(glow::BACK, glow::ZERO, glow::DECR, glow::INCR_WRAP);
        gl.stencil_mask_separate(glow::FRONT, 0x05);
        gl.stencil_mask_separate(glow::BACK, 0x0a);
        (raw.clamp_color)(glow::CLAMP_READ_COLOR, 0);
    }
}

unsafe fn rasterisation(gl: &glow::Context, raw: &Raw) {
    // SAFETY: as above.
    unsafe {
        gl.depth_range_f64(0.75, 0.25);
        gl.cull_face(glow::FRONT_AND_BACK);
        gl.front_face(glow::CW);
        gl.polygon_mode(glow::FRONT_AND_BACK, glow::LINE);
        gl.polygon_offset(3.0, 5.0);
        gl.viewport(3, 5, 7, 2);
        (raw.provoking_vertex)(glow::FIRST_VERTEX_CONVENTION);
        // This is the index of the second of a triangle's three vertices.
        (raw.primitive_restart_index)(1);
        gl.line_width(0.5);
        (raw.point_size)(3.0);
        (raw.point_parameter)(glow::POINT_FADE_THRESHOLD_SIZE, 2.0);
        (raw.point_parameter)(glow::POINT_SPRITE_COORD_ORIGIN, glow::LOWER_LEFT as f32);
        for hint in [
            glow::LINE_SMOOTH_HINT,
            glow::POLYGON_SMOOTH_HINT,
            glow::TEXTURE_COMPRESSION_HINT,
            glow::FRAGMENT_SHADER_DERIVATIVE_HINT,
        ] {
            gl.hint(hint, glow::FASTEST);
        }
    }
}

unsafe fn pixels(raw: &Raw) {
    for (parameter, value) in [
        (glow::UNPACK_ALIGNMENT, 8),
        (glow::UNPACK_ROW_LENGTH, 5),
        (glow::UNPACK_IMAGE_HEIGHT, 3),
        (glow::UNPACK_SKIP_PIXELS, 2),
        (glow::UNPACK_SKIP_ROWS, 1),
        (glow::UNPACK_SKIP_IMAGES, 1),
        (glow::UNPACK_SWAP_BYTES, 1),
        (glow::UNPACK_LSB_FIRST, 1),
        (glow::PACK_ALIGNMENT, 1),
        (glow::PACK_ROW_LENGTH, 3),
        (glow::PACK_IMAGE_HEIGHT, 2),
        (glow::PACK_SKIP_PIXELS, 1),
        (glow::PACK_SKIP_ROWS, 2),
        (glow::PACK_SKIP_IMAGES, 4),
        (glow::PACK_SWAP_BYTES, 1),
        (glow::PACK_LSB_FIRST, 1),
    ] {
        // SAFETY: as above.
        unsafe { (raw.pixel_store)(parameter, value) };
    }
}

/// Binds a buffer to each kind of target, and to each place of the targets with numbered places.
unsafe fn buffers(gl: &glow::Context, raw: &Raw) {
    // SAFETY: as above.
    unsafe {
        let buffer = |target: u32, size: i32| {
            let buffer = gl.create_buffer().unwrap();
            gl.bind_buffer(target, Some(buffer));
            gl.buffer_data_size(target, size, glow::STREAM_COPY);
            buffer
        };
        let vertices = gl.create_vertex_array().unwrap();
        gl.bind_vertex_array(Some(vertices));
        buffer(glow::ELEMENT_ARRAY_BUFFER, 16);
        let places = gl.get_parameter_i32(glow::MAX_UNIFORM_BUFFER_BINDINGS) as u32;
        for (target, places) in [(glow::UNIFORM_BUFFER, places), (glow::TRANSFORM_FEEDBACK_BUFFER, 4)] {
            for place in 0..places {
                let made = buffer(target, 2048);
                gl.bind_buffer_range(target, place, Some(made), 256, 512 + 4 * place as i32);
            }
        }
        for attribute in 0..16 {
            buffer(glow::ARRAY_BUFFER, 64);
            gl.vertex_attrib_pointer_f32(attribute, 2, glow::SHORT, true, 12, 4);
            gl.enable_vertex_attrib_array(attribute);
            gl.vertex_attrib_divisor(attribute, 2);
            gl.vertex_attrib_4_f32(attribute, 4.0, 3.0, 2.0, 1.5);
        }
        for target in [
            glow::PIXEL_PACK_BUFFER,
            glow::PIXEL_UNPACK_BUFFER,
            glow::COPY_READ_BUFFER,
            glow::COPY_WRITE_BUFFER,
            glow::TEXTURE_BUFFER,
        ] {
            let made = buffer(target, 24);
            if target == glow::TEXTURE_BUFFER {
                (raw.texture_buffer)(target, glow::R32F, made.0.get());
            }
        }
    }
}

/// Puts a program in use that captures what it draws, binds a buffer for that, and begins a query that counts what is
/// captured.
pub(crate) fn capture(gl: &glow::Context) -> glow::Query {
    // SAFETY: the context is current, and the buffer has room for points of four floats.
    unsafe {
        program(gl);
        let vertices = gl.create_vertex_array().unwrap();
        gl.bind_vertex_array(Some(vertices));
        let buffer = gl.create_buffer().unwrap();
        gl.bind_buffer_base(glow::TRANSFORM_FEEDBACK_BUFFER, 0, Some(buffer));
        gl.buffer_data_size(glow::TRANSFORM_FEEDBACK_BUFFER, 4096, glow::STREAM_COPY);
        let query = gl.create_query().unwrap();
        gl.begin_query(glow::TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, query);
        query
    }
}

unsafe fn program(gl: &glow::Context) {
    // SAFETY: as above.
    unsafe {
        let program = gl.create_program().unwrap();
        let stages = [
            (glow::VERTEX_SHADER, "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }"),
            (glow::FRAGMENT_SHADER, "#version 330 core\nout vec4 o; void main() { o = vec4(0.5); }"),
        ];
        for (stage, text) in stages {
            let shader = gl.create_shader(stage).unwrap();
            gl.shader_source(shader, text);
            gl.compile_shader(shader);
            gl.attach_shader(program, shader);
        }
        gl.transform_feedback_varyings(program, &["gl_Position"], glow::INTERLEAVED_ATTRIBS);
        gl.link_program(program);
        assert!(gl.get_program_link_status(program));
        gl.use_program(Some(program));
    }
}

/// Binds two framebuffers, one for drawing and one for reading.
unsafe fn framebuffers(gl: &glow::Context) {
    // SAFETY: as above.
    unsafe {
        let renderbuffer = gl.create_renderbuffer().unwrap();
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(renderbuffer));
        gl.renderbuffer_storage(glow::RENDERBUFFER, glow::RGBA8, 8, 8);
        let depth = gl.create_renderbuffer().unwrap();
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(depth));
        gl.renderbuffer_storage_multisample(glow::RENDERBUFFER, 4, glow::DEPTH_COMPONENT16, 8, 8);
        for target in [glow::READ_FRAMEBUFFER, glow::DRAW_FRAMEBUFFER] {
            let framebuffer = gl.create_framebuffer().unwrap();
            gl.bind_framebuffer(target, Some(framebuffer));
            if target == glow::READ_FRAMEBUFFER {
                gl.framebuffer_renderbuffer(target, glow::COLOR_ATTACHMENT2, glow::RENDERBUFFER, Some(renderbuffer));
                gl.read_buffer(glow::COLOR_ATTACHMENT2);
            }
        }
        for point in 0..8 {
            let texture = gl.create_texture().unwrap();
            gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            gl.tex_image_2d(
                glow::TEXTURE_2D,
                0,
                glow::RGBA8 as i32,
                8,
                8,
                0,
                glow::RGBA,
                glow::UNSIGNED_BYTE,
                glow::PixelUnpackData::Slice(None),
            );
            let attachment = glow::COLOR_ATTACHMENT0 + point;
            gl.framebuffer_texture_2d(glow::DRAW_FRAMEBUFFER, attachment, glow::TEXTURE_2D, Some(texture), 0);
        }
        let stencil = gl.create_renderbuffer().unwrap();
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(stencil));
        gl.renderbuffer_storage(glow::RENDERBUFFER, glow::DEPTH24_STENCIL8, 8, 8);
        let (target, point) = (glow::DRAW_FRAMEBUFFER, glow::DEPTH_STENCIL_ATTACHMENT);
        gl.framebuffer_renderbuffer(target, point, glow::RENDERBUFFER, Some(stencil));
        gl.bind_renderbuffer(glow::RENDERBUFFER, Some(depth));
        let backwards: Vec<u32> = (0..8).rev().map(|i| glow::COLOR_ATTACHMENT0 + i).collect();
        gl.draw_buffers(&backwards);
    }
}

/// Binds textures of every kind and a sampler to every unit. The textures on the first units have parameters of their
/// own.
unsafe fn textures(gl: &glow::Context) {
    let mut units = 0;
    // SAFETY: as above.
    unsafe {
        while {
            gl.active_texture(glow::TEXTURE0 + units);
            gl.get_error() == glow::NO_ERROR
        } {
            for (name, target) in TEXTURES {
                gl.bind_texture(target, Some(gl.create_texture().unwrap()));
                if name != "multisample" && units < 6 {
                    gl.tex_parameter_i32(target, glow::TEXTURE_MAG_FILTER, glow::NEAREST as i32);
                    gl.tex_parameter_i32(target, glow::TEXTURE_WRAP_S, glow::CLAMP_TO_BORDER as i32);
                    gl.tex_parameter_i32(target, glow::TEXTURE_SWIZZLE_R, glow::ALPHA as i32);
                    gl.tex_parameter_f32(target, glow::TEXTURE_LOD_BIAS, 1.5);
                }
            }
            for target in [glow::TEXTURE_BUFFER, glow::TEXTURE_2D_MULTISAMPLE_ARRAY] {
                gl.bind_texture(target, Some(gl.create_texture().unwrap()));
            }
            let sampler = gl.create_sampler().unwrap();
            gl.sampler_parameter_i32(sampler, glow::TEXTURE_MIN_FILTER, glow::LINEAR_MIPMAP_LINEAR as i32);
            gl.sampler_parameter_i32(sampler, glow::TEXTURE_WRAP_S, glow::MIRRORED_REPEAT as i32);
            gl.sampler_parameter_i32(sampler, glow::TEXTURE_COMPARE_MODE, glow::COMPARE_REF_TO_TEXTURE as i32);
            gl.sampler_parameter_f32(sampler, glow::TEXTURE_MIN_LOD, 2.0);
            gl.bind_sampler(units, Some(sampler));
            units += 1;
        }
        assert!(units >= 48, "{units}");
        gl.active_texture(glow::TEXTURE0 + 5);
    }
}
