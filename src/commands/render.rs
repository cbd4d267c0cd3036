//! `ntp render PATH --episode K (--mp4 | --gif | --png) FILE`.

use serde_json::json;

use crate::cli::RenderArgs;
use crate::commands::{CommandOutcome, UsageError, output, replay};
use crate::render::{CameraConfig, PictureQuality, Viewpoint};
use crate::video::{write_gif, write_mp4, write_png};

pub(super) fn run(args: &RenderArgs) -> anyhow::Result<CommandOutcome> {
    let camera = camera(args)?;
    let (file, episode) = replay::find_one(&args.path, args.episode)?;
    let (written, n_pictures) = match (&args.mp4, &args.gif, &args.png) {
        (Some(path), _, _) => (path, write_mp4(path, &episode, &camera, args.fps)?),
        (None, Some(path), _) => (path, write_gif(path, &episode, &camera, args.fps)?),
        (None, None, Some(path)) => {
            let position = args.frame.unwrap_or(episode.frames.len() - 1);
            let frame = episode.frames.get(position).ok_or_else(|| {
                UsageError(format!("--frame {position}: the episode has frames 0 to {}", episode.frames.len() - 1))
            })?;
            write_png(path, &episode, &camera, frame)?;
            (path, 1)
        }
        (None, None, None) => return Err(UsageError("render needs one of --mp4, --gif, --png".to_owned()).into()),
    };
    let [width, height] = camera.size_px;
    if args.json {
        output::print_json(&json!({
            "recording": file,
            "episode": args.episode,
            "camera": camera.name,
            "size_px": camera.size_px,
            "pictures": n_pictures,
            "written": written,
        }))?;
    } else {
        output::print(&format!(
            "episode {} of {} ({n_pictures} pictures of {width}x{height}) → {}",
            args.episode,
            file.display(),
            written.display()
        ))?;
    }
    Ok(CommandOutcome::Done)
}

/// The camera that is asked for, drawing as finely as for people.
fn camera(args: &RenderArgs) -> anyhow::Result<CameraConfig> {
    let wrong = || UsageError(format!("--size {}: one even number, or two as 640x480", args.size));
    let (width, height) = args.size.split_once('x').unwrap_or((&args.size, &args.size));
    let size_px = [width.parse().map_err(|_error| wrong())?, height.parse().map_err(|_error| wrong())?];
    let view = if args.camera == "wrist" { Viewpoint::Wrist } else { Viewpoint::Front };
    let camera = CameraConfig { quality: PictureQuality::Fine, ..CameraConfig::new(view, size_px) };
    camera.check().map_err(|error| UsageError(error.to_string()))?;
    Ok(camera)
}
