//! A layer as one flag: `steel.png,scale=4,rotation=30,mask=rust.png,channel=g`.

use glam::{Vec2, vec2};
use kinran::detail::TiledLayer;

/// Names that a layer takes, for the message.
const NAMES: &str =
    "scale, rotation, offset, mirror, hue, saturation, value, opacity, mask, channel, contrast, y-down, y-up";

/// `FILE[,NAME=VALUE]...`
pub(crate) fn layer_flag(text: &str) -> Result<TiledLayer, String> {
    let mut parts = text.split(',');
    let tile = parts.next().map(str::trim).filter(|file| !file.is_empty());
    let Some(tile) = tile else { return Err("write FILE or FILE,scale=4,...".into()) };
    let mut layer = TiledLayer::new(tile);
    for part in parts {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        let (name, value) = (name.trim(), value.trim());
        let number = || {
            value
                .parse::<f32>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or(format!("{name}={value}: write a number"))
        };
        let factor = || {
            number().and_then(|v| if v >= 0.0 { Ok(v) } else { Err(format!("{name} must not be negative")) })
        };
        match name {
            "scale" => layer.scale = pair(name, value)?,
            "rotation" => layer.rotation = number()?,
            "offset" => layer.offset = pair(name, value)?,
            "mirror" if value.is_empty() => layer.mirror = true,
            "hue" => layer.hue = number()?,
            "saturation" => layer.saturation = factor()?,
            "value" => layer.value = factor()?,
            "opacity" => {
                layer.opacity = number()?;
                if !(0.0..=1.0).contains(&layer.opacity) {
                    return Err(format!("opacity={value}: write a number from 0 to 1"));
                }
            }
            "mask" if !value.is_empty() => layer.mask = Some(value.into()),
            "channel" => {
                layer.channel = ["r", "g", "b", "a"]
                    .iter()
                    .position(|c| *c == value)
                    .ok_or(format!("channel={value}: choose r, g, b or a"))?;
            }
            "contrast" => layer.contrast = factor()?,
            "y-down" if value.is_empty() => layer.y_down = true,
            "y-up" if value.is_empty() => layer.y_down = false,
            _ => return Err(format!("a layer knows no {part}; it takes {NAMES}")),
        }
    }
    if layer.scale.x == 0.0 || layer.scale.y == 0.0 {
        return Err("scale must not be zero".into());
    }
    Ok(layer)
}

/// `4` or `4x2`.
fn pair(name: &str, value: &str) -> Result<Vec2, String> {
    let (x, y) = value.split_once(['x', 'X', '×']).unwrap_or((value, value));
    match (x.trim().parse::<f32>(), y.trim().parse::<f32>()) {
        (Ok(x), Ok(y)) if x.is_finite() && y.is_finite() => Ok(vec2(x, y)),
        _ => Err(format!("{name}={value}: write one number, or two as 4x2")),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn layers_are_read_as_they_are_written() {
        let layer = layer_flag(
            "a/steel.png, scale=4x-2,rotation=30,offset=0.5,mirror,mask=m.png,channel=g,contrast=2",
        )
        .unwrap();
        assert_eq!(layer.tile, PathBuf::from("a/steel.png"));
        assert_eq!((layer.scale, layer.offset, layer.rotation), (vec2(4.0, -2.0), Vec2::splat(0.5), 30.0));
        assert_eq!((layer.mirror, layer.channel, layer.contrast), (true, 1, 2.0));
        assert_eq!(layer.mask, Some("m.png".into()));
    }

    #[test]
    fn a_name_that_says_directx_is_taken_for_up() {
        for (text, down) in [
            ("brick_nor_dx.png", true),
            ("brick_nor_dx.png,y-up", false),
            ("brick_nor_dx.png,y-down", true),
            ("brick_nor_gl.png", false),
            ("brick_normal.png,y-down", true),
            ("brick_nor_dx.ktx2", false),
        ] {
            assert_eq!(layer_flag(text).unwrap().y_down, down, "{text}");
        }
    }

    #[test]
    fn layers_that_mean_nothing_are_refused() {
        for bad in [
            "",
            ",scale=2",
            "a,scale=0",
            "a,scale=x",
            "a,sclae=2",
            "a,channel=x",
            "a,mask=",
            "a,hue=nan",
            "a,value=-1",
            "a,opacity=2",
        ] {
            assert!(layer_flag(bad).is_err(), "{bad:?} became {:?}", layer_flag(bad));
        }
    }
}
