//! The film's bytes depend on the scene, the seed and the samples alone.

mod common;
use common::*;
use glam::Vec3;
use orthant_cpu::CpuBackend;
use orthant_resident::film::{BLOCK, Film};
use orthant_resident::frame::{Aov, PixelFilter, Tile};
use orthant_resident::rows::MaterialRow;
use orthant_resident::{Backend, BackendError, Environment, Frame, Ticket};
use std::time::Duration;

fn backend() -> CpuBackend {
    let rough = MaterialRow { roughness: 0.4, base_color: [0.9, 0.6, 0.3, 1.0], ..MaterialRow::DEFAULT };
    SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X * 3.0, Vec3::NEG_Z * 3.0), lambert(0.7))
        .add(sphere(Vec3::new(0.0, 0.5, 0.0), 0.5, 12), rough)
        .add(quad(Vec3::new(0.0, 2.0, 0.3), Vec3::X * 0.5, Vec3::Z * 0.5), lamp(4.0))
        .backend(Environment::constant([0.3; 3]))
}

fn whole() -> Frame {
    Frame {
        filter: PixelFilter::BlackmanHarris { radius: 1.5 },
        keep_blocks: true,
        aovs: vec![Aov::Albedo, Aov::Depth, Aov::Normal, Aov::Node, Aov::Material, Aov::Primitive, Aov::Position],
        roulette_depth: 2,
        firefly_clamp: Some(3.0),
        ..frame(camera(Vec3::new(0.0, 1.2, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0), 50, 37, 40)
    }
}

fn bits(film: &Film) -> Vec<u32> {
    film.sum.iter().flatten().map(|v| v.to_bits()).collect()
}

#[test]
fn threads_and_polls_do_not_change_a_byte() {
    let mut backend = backend();
    let one = render(&mut backend, Frame { threads: 1, ..whole() });
    let eight = render(&mut backend, Frame { threads: 8, ..whole() });
    assert_eq!(one, eight);
    let ticket = backend.submit(Frame { threads: 3, ..whole() }).unwrap();
    let mut polls = 0;
    let mut done = 0;
    loop {
        let status = backend.poll(ticket, Duration::ZERO).unwrap();
        assert!(status.done > done, "every poll gets on");
        done = status.done;
        polls += 1;
        if status.is_done() {
            assert_eq!(status.done, 50 * 37 * 40);
            assert_eq!(status.rays.camera, 50 * 37 * 40);
            break;
        }
    }
    assert!(polls > 10);
    assert_eq!(backend.read_film(ticket).unwrap(), one);
}

#[test]
fn tiles_are_parts_of_the_whole() {
    let mut backend = backend();
    let reference = render(&mut backend, whole());
    for tile in [Tile { x: 0, y: 0, width: 13, height: 37 }, Tile { x: 13, y: 5, width: 37, height: 20 }] {
        let part = render(&mut backend, Frame { tile, ..whole() });
        for y in 0..tile.height {
            for x in 0..tile.width {
                let (i, j) = ((y * tile.width + x) as usize, ((tile.y + y) * 50 + tile.x + x) as usize);
                assert_eq!(part.sum[i].map(f32::to_bits), reference.sum[j].map(f32::to_bits));
                for (a, b) in part.aovs.iter().zip(&reference.aovs) {
                    let n = a.0.channels();
                    assert_eq!(a.1[i * n..(i + 1) * n], b.1[j * n..(j + 1) * n]);
                }
            }
        }
    }
}

#[test]
fn shares_of_the_samples_add_up_to_the_whole() {
    let mut backend = backend();
    let reference = render(&mut backend, whole());
    let mut blocks = Vec::new();
    for samples in [16..32, 32..40, 0..16] {
        let share = render(&mut backend, Frame { samples, ..whole() });
        blocks.extend(share.blocks);
    }
    blocks.sort_by_key(|block| block.index);
    assert_eq!(blocks, reference.blocks);
    assert_eq!(blocks.iter().map(|b| b.samples).collect::<Vec<_>>(), [BLOCK, BLOCK, 8]);
    let mut sum = vec![[0.0f32; 3]; 50 * 37];
    for block in &blocks {
        for (s, v) in sum.iter_mut().zip(&block.sum) {
            for k in 0..3 {
                s[k] += v[k];
            }
        }
    }
    assert_eq!(sum, reference.sum);
}

#[test]
fn an_unfinished_film_holds_whole_blocks() {
    let mut backend = backend();
    let reference = bits(&render(&mut backend, Frame { samples: 0..16, ..whole() }));
    let ticket = backend.submit(Frame { threads: 2, samples: 0..4000, ..whole() }).unwrap();
    while backend.poll(ticket, Duration::ZERO).unwrap().done < 50 * 37 * 40 {}
    let film = backend.read_film(ticket).unwrap();
    assert!(film.samples.is_multiple_of(BLOCK) && film.samples <= 4000);
    if let Some(first) = film.blocks.first() {
        assert_eq!(first.sum.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>(), reference);
    }
    assert_eq!(film.samples, BLOCK * film.blocks.len() as u32);
}

#[test]
fn another_seed_is_another_image_with_the_same_mean() {
    let mut backend = backend();
    let (a, b) = (render(&mut backend, whole()), render(&mut backend, Frame { seed: 2, ..whole() }));
    assert_ne!(bits(&a), bits(&b));
    assert_close(mean(&a).x, mean(&b).x, 1e-2, "mean");
}

#[test]
fn tickets_end_with_a_new_frame_and_with_readback() {
    let mut backend = backend();
    let first = backend.submit(whole()).unwrap();
    let second = backend.submit(whole()).unwrap();
    assert_eq!(backend.poll(first, Duration::ZERO), Err(BackendError::UnknownTicket(first)));
    backend.read_film(second).unwrap();
    assert_eq!(backend.read_film(second), Err(BackendError::UnknownTicket(second)));
    assert_eq!(backend.read_film(Ticket(99)), Err(BackendError::UnknownTicket(Ticket(99))));
}

#[test]
fn frames_that_cannot_be_rendered_are_refused() {
    let mut backend = backend();
    let bad = [
        Frame { width: 0, ..whole() },
        Frame { tile: Tile { x: 40, y: 0, width: 11, height: 1 }, ..whole() },
        Frame { tile: Tile { x: u32::MAX, y: 0, width: 2, height: 1 }, ..whole() },
        Frame { samples: 8..16, ..whole() },
        Frame { samples: 16..16, ..whole() },
        Frame { max_depth: 0, ..whole() },
        Frame { firefly_clamp: Some(f32::NAN), ..whole() },
        Frame { filter: PixelFilter::Tent { radius: -1.0 }, ..whole() },
        Frame { camera: orthant_resident::Camera { near: 2.0, far: 1.0, ..whole().camera }, ..whole() },
    ];
    for frame in bad {
        assert!(matches!(backend.submit(frame.clone()), Err(BackendError::InvalidFrame(_))), "{frame:?}");
    }
}

#[test]
fn an_empty_scene_shows_the_environment() {
    let mut backend = CpuBackend::new();
    assert_eq!(mean(&render(&mut backend, whole())), Vec3::ZERO);
    backend.set_environment(Environment::constant([1.0, 2.0, 3.0])).unwrap();
    let film = render(&mut backend, whole());
    assert_eq!(mean(&film), Vec3::new(1.0, 2.0, 3.0));
    let depth = film.aovs.iter().find(|(aov, _)| *aov == Aov::Depth).unwrap();
    assert!(depth.1.iter().all(|d| *d == f32::INFINITY));
}

#[test]
fn aovs_show_what_the_ray_through_the_centre_hits() {
    let mut backend = backend();
    let film = render(&mut backend, whole());
    let at = |aov: Aov, x: usize, y: usize| {
        let values = &film.aovs.iter().find(|(a, _)| *a == aov).unwrap().1;
        let n = aov.channels();
        values[(y * 50 + x) * n..(y * 50 + x + 1) * n].to_vec()
    };
    // The sphere in the middle is the second node; nothing is at the top.
    assert_eq!(at(Aov::Node, 25, 18), [101.0]);
    assert_eq!(at(Aov::Primitive, 25, 18), [1.0]);
    assert_eq!(at(Aov::Material, 25, 18), [-1.0], "the default material has no index");
    assert_eq!(at(Aov::Node, 25, 0), [-1.0]);
    let p = Vec3::from_slice(&at(Aov::Position, 25, 18));
    assert!((p.distance(Vec3::new(0.0, 0.5, 0.0)) - 0.5).abs() < 0.02, "{p}");
    let camera = whole().camera;
    let depth = (p - Vec3::from(camera.position)).dot(Vec3::from(camera.forward));
    assert!((at(Aov::Depth, 25, 18)[0] - depth).abs() < 1e-4);
    let albedo = at(Aov::Albedo, 25, 18);
    assert!((albedo[0] - 0.9).abs() < 1e-3 && (albedo[2] - 0.3).abs() < 1e-3);
    assert!(Vec3::from_slice(&at(Aov::Normal, 25, 18)).length() > 0.9);
}
