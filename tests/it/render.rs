//! Pictures with known answers: places, depths, segments, light, and that all of it repeats.

use ntp::geometry::{Pose, Rotation, Vec3, upright};
use ntp::render::{
    Camera, CameraConfig, Letters, Look, Mount, Randomization, Renderer, Segment, Shadows, Viewpoint, looking_at,
};
use ntp::scene::{Body, BodyIndex, Mobility, Scene, SceneState, Shape};
use ntp::seed::Seed;
use ntp::task::{Family, initial_state, scene};

const CUBE: BodyIndex = BodyIndex(0);

/// One cube of 10 cm on the table, and the gripper out of the picture.
fn cube_scene() -> (Scene, SceneState) {
    let shape = Shape::Cuboid { half_extents_m: [0.05; 3] };
    let cube = Body { name: "cube".to_owned(), shape, mobility: Mobility::Movable, color: [200, 40, 40] };
    let scene = Scene { bodies: vec![cube], slots: Vec::new(), table_half_m: [0.6, 0.6] };
    let state = SceneState {
        gripper_in_world: upright(Vec3::new(5.0, 5.0, 5.0), 0.0),
        opening_m: 0.07,
        held: None,
        bodies_in_world: vec![upright(Vec3::new(0.0, 0.0, 0.05), 0.0)],
        joints_rad: None,
    };
    (scene, state)
}

/// 1 m above the table, looking down: a pixel is 2 mm wide at 1 m.
fn from_above() -> Camera {
    let pose = looking_at(&Vec3::z(), &Vec3::zeros());
    Camera { width: 301, height: 201, focal_px: 500.0, mount: Mount::World(pose) }
}

#[test]
fn a_camera_looks_at_its_target_from_every_side() {
    let target = Vec3::new(-0.27, 0.06, 0.03);
    let away = [-1.0, 0.0, 1.0].map(|x| [-1.0, 0.0, 1.0].map(|y| [x, y]));
    for [x, y] in away.concat() {
        for z in [-1.0, 0.0, 1.0] {
            let from_target = Vec3::new(x, y, z) * 0.95;
            if from_target.norm() == 0.0 {
                continue;
            }
            let pose = looking_at(&(target + from_target), &target);
            let forward = pose * Vec3::z();
            assert!((forward + from_target.normalize()).norm() < 1e-4, "{x} {y} {z}: {forward}");
            // The picture's y points down.
            let down = pose * Vec3::y();
            assert!(down.z <= 1e-4 && (pose * Vec3::x()).z.abs() < 1e-4, "{x} {y} {z}: {down}");
        }
    }
}

#[test]
fn a_face_at_a_known_depth_has_this_depth_segment_and_extent() {
    let (scene, state) = cube_scene();
    let mut renderer = Renderer::new(Look::plain());
    let picture = renderer.draw(&scene, &state, &from_above());
    assert_eq!(picture.segment(150, 100), Segment::Body(CUBE));
    assert!((picture.depth_at_m(150, 100) - 0.9).abs() < 1e-5);
    assert_eq!(picture.segment(10, 100), Segment::Table);
    assert!((picture.depth_at_m(10, 100) - 1.0).abs() < 1e-5);
    // 0.1 m at 0.9 m with a focal length of 500 pixels: 55.6 pixels wide.
    let wide = (0..301).filter(|&column| picture.segment(column, 100) == Segment::Body(CUBE)).count();
    let high = (0..201).filter(|&row| picture.segment(150, row) == Segment::Body(CUBE)).count();
    assert!((55..=56).contains(&wide) && (55..=56).contains(&high), "{wide} x {high}");
}

#[test]
fn depth_is_true_to_a_slanted_face_everywhere() {
    let (scene, mut state) = cube_scene();
    let tilt = Rotation::from_axis_angle(&Vec3::y_axis(), 0.4);
    state.bodies_in_world[0] = Pose::from_parts(Vec3::new(0.02, -0.01, 0.2).into(), tilt);
    let camera = from_above();
    let mut renderer = Renderer::new(Look::plain());
    let picture = renderer.draw(&scene, &state, &camera).clone();
    let mut n_checked = 0;
    for row in 0..picture.height {
        for column in 0..picture.width {
            if picture.segment(column, row) != Segment::Body(CUBE) {
                continue;
            }
            let point = camera.point_at(&state, [column as f32, row as f32], picture.depth_at_m(column, row));
            let on_cube = state.bodies_in_world[0].inverse_transform_point(&point.into()).coords;
            assert!((on_cube.amax() - 0.05).abs() < 1e-5, "{on_cube} is not on the cube");
            n_checked += 1;
        }
    }
    assert!(n_checked > 2000);
}

#[test]
fn depths_alone_are_those_of_the_picture() {
    for family in Family::ALL {
        let scene = scene(family, &[]);
        let state = initial_state(family, &scene, Seed(3));
        let camera = Camera::front(family, [128, 96]);
        let mut renderer = Renderer::new(Look { shadows: Shadows::None, ..Look::plain() });
        let whole = renderer.draw(&scene, &state, &camera).clone();
        let depths = renderer.draw_depths(&scene, &state, &camera).clone();
        assert_eq!((&depths.depth_m, &depths.segments), (&whole.depth_m, &whole.segments), "{}", family.name());
        assert!(depths.rgb.is_empty());
        assert_eq!(*renderer.draw(&scene, &state, &camera), whole, "what was drawn before does not show");
    }
}

#[test]
fn a_point_falls_where_the_calibration_says() {
    let (_, state) = cube_scene();
    let camera = Camera::front(Family::BlockStacking, [640, 480]);
    let point = Vec3::new(0.1, -0.05, 0.3);
    let [column, row, depth] = camera.project(&state, &point).unwrap();
    let matrix = nalgebra::Matrix3::from_row_slice(&camera.matrix());
    let in_camera = camera.in_world(&state).inverse_transform_point(&point.into()).coords.cast::<f64>();
    let projected = matrix * in_camera;
    assert!((projected.x / projected.z - f64::from(column)).abs() < 1e-3);
    assert!((projected.y / projected.z - f64::from(row)).abs() < 1e-3);
    assert!((projected.z - f64::from(depth)).abs() < 1e-6);
    assert!((camera.point_at(&state, [column, row], depth) - point).norm() < 1e-5);
}

#[test]
fn a_small_thing_is_drawn_at_its_projected_place() {
    let (mut scene, mut state) = cube_scene();
    scene.bodies[0].shape = Shape::Ball { radius_m: 0.02 };
    let place = Vec3::new(0.13, 0.07, 0.2);
    state.bodies_in_world[0] = upright(place, 0.0);
    let camera = Camera::front(Family::BlockStacking, [320, 240]);
    let mut renderer = Renderer::new(Look::plain());
    let picture = renderer.draw(&scene, &state, &camera);
    let shown: Vec<[f32; 2]> = (0..picture.width * picture.height)
        .map(|pixel| (pixel % picture.width, pixel / picture.width))
        .filter(|&(column, row)| picture.segment(column, row) == Segment::Body(CUBE))
        .map(|(column, row)| [column as f32, row as f32])
        .collect();
    let mean = |axis: usize| shown.iter().map(|pixel| pixel[axis]).sum::<f32>() / shown.len() as f32;
    let [column, row, _] = camera.project(&state, &place).unwrap();
    assert!((mean(0) - column).abs() < 0.3 && (mean(1) - row).abs() < 0.3);
}

#[test]
fn the_camera_on_the_gripper_moves_with_it() {
    let (scene, mut state) = cube_scene();
    state.gripper_in_world = upright(Vec3::new(0.0, 0.0, 0.3), 0.0);
    let camera = Camera::wrist([64, 64]);
    let mut renderer = Renderer::new(Look::plain());
    let before = renderer.draw(&scene, &state, &camera).clone();
    assert!(before.segments.contains(&Segment::Gripper.number()) && before.segments.contains(&3));
    let shift = Vec3::new(0.1, 0.05, 0.0);
    state.gripper_in_world.translation.vector += shift;
    state.bodies_in_world[0].translation.vector += shift;
    let after = renderer.draw(&scene, &state, &camera);
    let same = before.segments.iter().zip(&after.segments).filter(|(before, after)| before == after).count();
    assert!(same * 20 > 19 * 64 * 64, "{same} of 4096 pixels show the same");
}

#[test]
fn what_stands_between_sun_and_table_darkens_it() {
    let (scene, state) = cube_scene();
    // The sun stands at 45 degrees towards -x: the cube's shadow on the table reaches from x = 0.05 to 0.15.
    let light = ntp::render::Light { to_sun: Vec3::new(-1.0, 0.0, 1.0), ..Look::plain().light };
    for shadows in [Shadows::Sharp, Shadows::Soft] {
        let mut renderer = Renderer::new(Look { light, shadows, ..Look::plain() });
        let picture = renderer.draw(&scene, &state, &from_above());
        let brightness = |x: f32| {
            let [red, green, blue] = picture.color((150.0 + 500.0 * x) as u32, 100);
            u32::from(red) + u32::from(green) + u32::from(blue)
        };
        assert!(5 * brightness(0.1) < 4 * brightness(0.2), "{shadows:?}");
        assert!(5 * brightness(0.1) < 4 * brightness(-0.2), "{shadows:?}");
        // The lit top of the cube is not in its own shadow.
        assert_eq!(picture.color(140, 100), picture.color(160, 100));
    }
}

#[test]
fn a_lit_tower_does_not_shadow_its_own_lit_sides() {
    let (mut scene, mut state) = cube_scene();
    let body = scene.bodies[0].clone();
    scene.bodies.push(Body { name: "upper".to_owned(), ..body });
    state.bodies_in_world.push(upright(Vec3::new(0.0, 0.0, 0.15), 0.0));
    let camera =
        Camera::new(Mount::World(looking_at(&Vec3::new(-1.0, 0.0, 0.3), &Vec3::new(0.0, 0.0, 0.1))), [64, 64], 0.4);
    let bare = Renderer::new(Look { shadows: Shadows::None, ..Look::plain() }).draw(&scene, &state, &camera).clone();
    let mut renderer = Renderer::new(Look::plain());
    let shadowed = renderer.draw(&scene, &state, &camera);
    let on_tower = |pixel: &usize| bare.segments[*pixel] >= 3;
    let pixels: Vec<usize> = (0..64 * 64).filter(on_tower).collect();
    let darker = pixels.iter().filter(|&&pixel| shadowed.rgb[3 * pixel] < bare.rgb[3 * pixel]).count();
    assert!(darker * 20 < pixels.len(), "{darker} of {} pixels of lit sides are dark", pixels.len());
}

#[test]
fn the_same_arguments_give_the_same_bytes_whatever_was_drawn_before() {
    for family in Family::ALL {
        let counts = [2, 2, 2, 2, 3, 1];
        let scene = scene(family, &counts);
        let state = initial_state(family, &scene, Seed(3));
        let (other_scene, other_state) = cube_scene();
        for look in [Look::plain(), Look::smooth(), Look::fine()] {
            let camera = Camera::front(family, [48, 32]);
            let fresh = Renderer::new(look.clone()).draw(&scene, &state, &camera).clone();
            let mut used = Renderer::new(look);
            used.draw(&other_scene, &other_state, &Camera::wrist([100, 70]));
            assert_eq!(*used.draw(&scene, &state, &camera), fresh, "{family:?}");
        }
    }
}

#[test]
fn every_body_that_the_camera_sees_is_drawn_with_its_own_number() {
    let scene = scene(Family::ObjectSorting, &[10, 10, 10, 10]);
    let state = initial_state(Family::ObjectSorting, &scene, Seed(5));
    let mut renderer = Renderer::new(Look::smooth());
    let picture = renderer.draw(&scene, &state, &Camera::front(Family::ObjectSorting, [224, 224]));
    for body in scene.body_indices() {
        assert!(picture.segments.contains(&Segment::Body(body).number()), "{}", scene.body(body).name);
    }
}

#[test]
fn a_camera_that_moves_as_far_as_is_allowed_keeps_the_middle_of_the_table_in_its_picture() {
    let randomize = Randomization { camera_m: 0.5, camera_rad: 0.5, ..Randomization::default() };
    let config = CameraConfig { randomize, ..CameraConfig::new(Viewpoint::Front, [64, 48]) };
    let (_, state) = cube_scene();
    for seed in 0..300 {
        let camera = config.camera(Family::BlockStacking, Seed(seed));
        let [column, row, _] = camera.project(&state, &Vec3::zeros()).unwrap();
        assert!((5.0..58.0).contains(&column) && (3.0..44.0).contains(&row), "seed {seed}: {column}, {row}");
    }
}

#[test]
fn a_randomised_episode_depends_on_its_seed_alone() {
    let (scene, state) = cube_scene();
    let all = Randomization { light: 1.0, color: 1.0, camera_m: 0.03, camera_rad: 0.05, one_color: false };
    let camera = Camera::front(Family::BlockStacking, [64, 64]);
    let draw = |seed: u64| {
        let look = all.look(&Look::plain(), &scene, Seed(seed));
        Renderer::new(look).draw(&scene, &state, &all.camera(&camera, Seed(seed))).clone()
    };
    assert_eq!(draw(1), draw(1));
    assert_ne!(draw(1).rgb, draw(2).rgb);
    assert_ne!(draw(1).depth_m, draw(2).depth_m);
    let none = Randomization::default();
    assert!(none.is_none() && none.camera(&camera, Seed(1)) == camera);
}

#[test]
fn with_one_color_blocks_differ_by_their_letters_alone() {
    let scene = scene(Family::BlockStacking, &[]);
    let one_color = Randomization { one_color: true, ..Randomization::default() };
    let look = one_color.look(&Look::plain(), &scene, Seed(1));
    assert!(look.body_colors.windows(2).all(|pair| pair[0] == pair[1]));
    let mut state = initial_state(Family::BlockStacking, &scene, Seed(3));
    let pose = state.bodies_in_world[0];
    let mut seen = |body: usize, letters: Letters| {
        state.bodies_in_world.iter_mut().for_each(|far| far.translation.vector.x = 9.0);
        state.bodies_in_world[body] = pose;
        let camera = Camera::front(Family::BlockStacking, [224, 224]);
        Renderer::new(Look { letters, ..look.clone() }).draw(&scene, &state, &camera).rgb.clone()
    };
    assert_ne!(seen(0, Letters::Small), seen(1, Letters::Small));
    assert_eq!(seen(0, Letters::None), seen(1, Letters::None));
}

#[test]
fn any_two_letters_of_one_color_differ_at_64_pixels() {
    let scene = scene(Family::BlockStacking, &[1; 8]);
    let randomize = Randomization { light: 0.5, color: 0.3, one_color: true, ..Randomization::default() };
    let config = CameraConfig { randomize, ..CameraConfig::new(Viewpoint::Front, [64, 64]) };
    for seed in 0..8 {
        let camera = config.camera(Family::BlockStacking, Seed(seed));
        let mut renderer = Renderer::new(config.look(&scene, Seed(seed)));
        let mut state = initial_state(Family::BlockStacking, &scene, Seed(seed));
        let pose = state.bodies_in_world[seed as usize];
        let mut shown = |body: usize| {
            state.bodies_in_world.iter_mut().for_each(|far| far.translation.vector.x = 9.0);
            state.bodies_in_world[body] = pose;
            let picture = renderer.draw(&scene, &state, &camera);
            let pixels = (0..64 * 64).filter(|&pixel| picture.segments[pixel] == 3 + body as u16);
            pixels.flat_map(|pixel| &picture.rgb[3 * pixel..][..3]).copied().collect::<Vec<u8>>()
        };
        let blocks: Vec<Vec<u8>> = (0..8).map(&mut shown).collect();
        for (at, one) in blocks.iter().enumerate() {
            for (other_at, other) in blocks.iter().enumerate().skip(at + 1) {
                assert!((60..180).contains(&one.len()) && one.len() == other.len(), "{} bytes", one.len());
                let squares: u32 = one.iter().zip(other).map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum();
                let apart = (squares as f32 / one.len() as f32).sqrt();
                assert!(apart > 4.0, "seed {seed}: letters {at} and {other_at} are {apart} of 255 apart");
            }
        }
    }
}

#[test]
fn a_camera_in_the_middle_of_things_draws_without_fault() {
    let (scene, state) = cube_scene();
    for eye in [[0.0, 0.0, 0.05], [0.0501, 0.0, 0.05], [0.0, 0.0, 0.1001], [0.0, 0.0, 0.0]] {
        for target in [[1.0, 0.0, 0.05], [0.0, 0.0, 1.0], [0.3, 0.2, -1.0]] {
            let mount = Mount::World(looking_at(&eye.into(), &target.into()));
            let picture =
                Renderer::new(Look::smooth()).draw(&scene, &state, &Camera::new(mount, [33, 17], 1.5)).clone();
            assert!(picture.depth_m.iter().all(|depth| *depth > 0.0));
        }
    }
}

#[test]
fn blocks_that_stand_aside_are_in_no_usual_picture() {
    let scene = scene(Family::BlockStacking, &[1, 1, 0, 0, 0, 0, 0, 0]);
    let reach = Randomization { camera_m: 0.03, camera_rad: 0.05, ..Randomization::default() };
    let [front, wrist] = [Camera::front(Family::BlockStacking, [64, 64]), Camera::wrist([64, 64])];
    let mut renderer = Renderer::new(Look::plain());
    let mut check = |state: &SceneState, camera: &Camera, seen: &[u16]| {
        let segments = &renderer.draw(&scene, state, camera).segments;
        for body in scene.body_indices() {
            let is_seen = segments.contains(&Segment::Body(body).number());
            assert!(!is_seen || seen.contains(&body.0), "{}", scene.body(body).name);
        }
    };
    for seed in 0..100 {
        let state = initial_state(Family::BlockStacking, &scene, Seed(seed));
        for camera in [front, wrist, reach.camera(&front, Seed(seed))] {
            check(&state, &camera, &[0, 1]);
        }
        for above in [0, 1] {
            let mut over = state.clone();
            over.gripper_in_world.translation.vector = state.bodies_in_world[above].translation.vector;
            over.gripper_in_world.translation.vector.z += 0.3;
            check(&over, &wrist, &[0, 1]);
        }
    }
}
