//! Which instructions a kernel runs with: the best that the processor has, found while running. Bytes do not depend on it.

use pulp::{Arch, WithSimd};

/// Runs a kernel. All of them are run by this function, which is how tests know them.
#[inline(always)]
pub(crate) fn dispatch<K: WithSimd>(kernel: K) -> K::Output {
    #[cfg(test)]
    let arch = tests::chosen(std::any::type_name::<K>());
    #[cfg(not(test))]
    let arch = Arch::new();
    arch.dispatch(kernel)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Mutex};

    use glam::{Vec2, Vec3, vec2, vec3};
    use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, Transfer, untold};
    use kinran_scene::Wrap;

    use super::*;
    use crate::aniso::{
        DirectionMap, Filter, Kernel, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps,
        SurfaceOptions, Weights, bake_surface, ndf_error,
    };
    use crate::curvature::{Mesh, Method, Options, bake_curvature};
    use crate::detail::{Blend, DetailOptions, Layer, MapKind, Target, Tile, TileOptions, solve};
    use crate::plain_levels;

    /// One more than the index in [`archs`] of what all kernels run with, 0 for the best. Other tests may run meanwhile: their
    /// results do not depend on it, or should not.
    static CHOSEN: AtomicUsize = AtomicUsize::new(0);

    /// Names of kernels that ran since it was emptied.
    static RAN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

    pub(super) fn chosen(kernel: &str) -> Arch {
        let chosen = CHOSEN.load(Ordering::Relaxed);
        if chosen == 0 {
            return Arch::new();
        }
        // Path and parameters do not matter, the folder in front of it does.
        let path = kernel.split('<').next().unwrap();
        let name = path.split("::").skip(1).collect::<Vec<_>>().join("::");
        RAN.lock().unwrap().insert(name);
        archs()[chosen - 1].1
    }

    /// Scalar code and each set of instructions that the machine has and kernels are compiled for.
    fn archs() -> Vec<(&'static str, Arch)> {
        let mut archs = vec![("scalar", Arch::Scalar)];
        #[cfg(target_arch = "x86_64")]
        {
            archs.extend(pulp::x86::V3::try_new().map(|simd| ("x86-64-v3", Arch::V3(simd))));
            archs.extend(pulp::x86::V4::try_new().map(|simd| ("x86-64-v4", Arch::V4(simd))));
        }
        #[cfg(target_arch = "aarch64")]
        archs.extend(pulp::aarch64::Neon::try_new().map(|simd| ("NEON", Arch::Neon(simd))));
        archs
    }

    /// Module and name of every kernel in the crate's sources.
    fn kernels(folder: &Path, module: &str, found: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            let module =
                if matches!(name, "mod" | "lib") { module.to_owned() } else { format!("{module}{name}::") };
            if path.is_dir() {
                kernels(&path, &module, found);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
            for rest in code.split("WithSimd for ").skip(1) {
                let name: String = rest.chars().take_while(|c| c.is_alphanumeric()).collect();
                found.insert(format!("{module}{name}"));
            }
            assert!(
                name == "simd" || !code.contains("Arch::"),
                "{}: kernels run by `simd::dispatch` alone",
                path.display()
            );
        }
    }

    fn random(seed: u32, i: u32) -> u8 {
        let mut h = seed.wrapping_mul(0x9e37_79b1) ^ i.wrapping_mul(0x85eb_ca77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        (h ^ (h >> 12)) as u8
    }

    /// Odd sizes, so that no row is a whole number of lanes.
    const SIZE: (u32, u32) = (75, 45);

    fn noise(seed: u32) -> Image {
        let samples = (0..SIZE.0 * SIZE.1 * 3).map(|i| 40 + random(seed, i) / 4 * 3).collect();
        Image::new(SIZE.0, SIZE.1, Channels::Rgb, Pixels::U8(samples)).unwrap()
    }

    /// What comes out of every stage, by name.
    fn all_stages() -> Vec<(String, Vec<u8>)> {
        let mut results = Vec::new();
        let packed = noise(9);
        let maps = SurfaceMaps {
            normal: NormalMap::new(Arc::new(noise(1)), true),
            roughness: RoughnessMaps::Gloss {
                u: ScalarMap::channel(Arc::new(noise(2)), 0),
                v: ScalarMap::channel(Arc::new(noise(3)), 1),
                direction: Some(DirectionMap::Vector(Arc::new(noise(4)))),
            },
            wrap: [Wrap::Repeat, Wrap::Mirror],
            weights: None,
        };
        let encoding = |format| Encoding { format, encoder: Encoder::Portable, preset: Preset::Fast };
        let request =
            |sheet, format, packed_with| SheetRequest { sheet, encoding: encoding(format), packed_with };
        let requests = [
            request(Sheet::Normal, Format::Rgba8, None),
            request(Sheet::Aniso, Format::Bc7, None),
            request(Sheet::Roughness, Format::Rgba8, Some(&packed)),
            request(Sheet::KhrAnisotropy, Format::Rgba16F, None),
        ];
        let weights = (0..SIZE.0 * SIZE.1).map(|i| u16::from(random(10, i)) << 8).collect();
        let weighted = SurfaceMaps { weights: Weights::new(SIZE, weights).map(Arc::new), ..maps.clone() };
        for filter in Filter::ALL {
            for (kernel, maps) in [(Kernel::Box, &maps), (Kernel::Tent, &maps), (Kernel::Tent, &weighted)] {
                let options = SurfaceOptions { filter, kernel };
                let Ok(baked) = bake_surface(maps, options, &requests, &untold) else {
                    assert_eq!((filter, kernel), (Filter::Param, Kernel::Box), "only param has one kernel");
                    continue;
                };
                let bytes = baked.textures.iter().flat_map(|t| &t.levels).flat_map(|level| &level.data);
                let name = format!("surface, {} and {kernel:?}", filter.name());
                results.push((name, bytes.copied().collect()));
                results.push((format!("errors of {}", filter.name()), format!("{:?}", baked.levels).into()));
            }
        }
        for transfer in [Transfer::Srgb, Transfer::Linear] {
            let levels =
                plain_levels(&packed, SIZE, transfer, Kernel::Tent, [Wrap::Clamp; 2], &untold).unwrap();
            let bytes = levels.into_iter().flat_map(|level| level.rgba8).collect();
            results.push((format!("plain levels, {transfer:?}"), bytes));
        }

        for (kind, format) in [
            (MapKind::Color, Format::Bc1),
            (MapKind::Color, Format::Bc7),
            (MapKind::Data, Format::Bc7),
            (MapKind::Normal, Format::Bc5),
            (MapKind::Aniso, Format::Bc7),
        ] {
            let tile = Tile::new(&noise(11), TileOptions::new(kind, encoding(format))).unwrap();
            let mut layer = Layer::new(&tile);
            layer.transform.scale = Vec2::splat(3.0);
            let target = Target::new(&noise(12), kind, false).unwrap();
            for blend in [Blend::Smooth, Blend::Plain] {
                let options = DetailOptions { blend, ..DetailOptions::new(encoding(format)) };
                let solved = solve(&target, &[layer], &options, &untold).unwrap();
                let bytes = solved.texture.levels.iter().flat_map(|level| &level.data).copied().collect();
                results.push((format!("detail, {kind:?}, {format:?}, {blend:?}"), bytes));
                results.push((format!("errors of {kind:?}"), format!("{:?}", solved.levels).into()));
            }
        }
        // One channel goes in blocks of their own.
        let grey = |seed| {
            let samples = (0..SIZE.0 * SIZE.1).map(|i| random(seed, i)).collect();
            Image::new(SIZE.0, SIZE.1, Channels::R, Pixels::U8(samples)).unwrap()
        };
        let tile = Tile::new(&grey(13), TileOptions::new(MapKind::Data, encoding(Format::Bc4))).unwrap();
        let target = Target::new(&grey(14), MapKind::Data, false).unwrap();
        let options = DetailOptions::new(encoding(Format::Bc4));
        let solved = solve(&target, &[Layer::new(&tile)], &options, &untold).unwrap();
        results.push(("detail, Bc4".into(), solved.texture.levels[0].data.clone()));

        // A bumpy sphere.
        let (rings, sides) = (21, 37);
        let at = |i: u32| {
            let (ring, side) = (i / sides, i % sides);
            let (sin, cos) = (ring as f32 / (rings - 1) as f32 * std::f32::consts::PI).sin_cos();
            let turn = Vec2::from_angle(side as f32 / sides as f32 * std::f32::consts::TAU);
            vec3(sin * turn.x, sin * turn.y, cos) * (1.0 + f32::from(random(15, i)) / 5000.0)
        };
        let positions: Vec<Vec3> = (0..rings * sides).map(at).collect();
        let quads = (0..rings - 1).flat_map(|ring| (0..sides).map(move |side| (ring, side)));
        let triangles: Vec<[u32; 3]> = quads
            .flat_map(|(ring, side)| {
                let next = (side + 1) % sides;
                let (a, b) = (ring * sides + side, ring * sides + next);
                [[a, a + sides, b], [b, a + sides, b + sides]]
            })
            .collect();
        let mesh = Mesh { positions: &positions, normals: None, tangents: None, triangles: &triangles };
        for method in [Method::Normals, Method::Fit] {
            let options = Options { method, millimetres: 100.0, ..Options::default() };
            let baked = bake_curvature(&mesh, &options, &untold).unwrap();
            results.push((format!("curvature, {method:?}"), format!("{:?}", baked.tensors).into()));
        }

        let texels: Vec<_> = (0..13)
            .map(|i| {
                let xy = vec2(f32::from(random(16, i)), f32::from(random(17, i))) / 255.0 - 0.5;
                let a = f32::from(random(18, i)) / 255.0;
                (xy.extend(1.0).normalize(), kinran_shading::Sym2::scalar(0.01 + 0.5 * a))
            })
            .collect();
        results.push(("ndf_error".into(), ndf_error(&texels, texels[0]).to_le_bytes().to_vec()));
        results
    }

    #[test]
    fn bytes_depend_on_the_processor() {
        let mut written = BTreeSet::new();
        kernels(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut written);
        let mut wanted = None;
        for (i, (name, _)) in archs().iter().enumerate() {
            CHOSEN.store(i + 1, Ordering::Relaxed);
            let got = all_stages();
            CHOSEN.store(0, Ordering::Relaxed);
            let ran = std::mem::take(&mut *RAN.lock().unwrap());
            let missed: Vec<_> = written.difference(&ran).collect();
            assert!(missed.is_empty(), "kernels that this test does not run: {missed:?}; it ran {ran:?}");
            let Some(wanted) = &wanted else {
                wanted = Some(got);
                continue;
            };
            for ((stage, wanted), (_, got)) in wanted.iter().zip(&got) {
                let apart = wanted.iter().zip(got).position(|(a, b)| a != b);
                assert!(
                    wanted == got,
                    "{stage}: {name} gives other bytes than scalar code, from byte {apart:?} of {} on",
                    wanted.len()
                );
            }
        }
    }
}
