//! `ntp render PATH --episode K (--mp4 | --gif | --png) FILE`.

use anyhow::Context as _;
use serde_json::json;

use crate::cli::RenderArgs;
use crate::commands::replay::{self, Found};
use crate::commands::{CommandOutcome, UsageError, output};
use crate::render::{CameraConfig, PictureQuality, Viewpoint};
use crate::video::{Clip, ClipConfig, write_gif, write_mp4, write_png};
use crate::words::counted;

/// Width and height of pictures for people.
const SIZE_PX: [u32; 2] = [480, 480];

pub(super) fn run(args: &RenderArgs) -> anyhow::Result<CommandOutcome> {
    for (option, path) in [("--mp4", &args.mp4), ("--gif", &args.gif), ("--png", &args.png)] {
        path.iter().try_for_each(|path| output::refuse_replacing(&args.path, option, path))?;
    }
    let found =
        replay::find(&args.path, &[args.episode.into()])?.into_iter().next().context("an episode that was found")?;
    let (camera, Found { file, episode, .. }) = (camera(args, &found.cameras)?, found);
    let clip = ClipConfig { fps: args.fps, speed: args.speed, programs: args.programs };
    let (written, made) = match (&args.mp4, &args.gif, &args.png) {
        (Some(path), _, _) => (path, write_mp4(path, &episode, &camera, &clip)?),
        (None, Some(path), _) => (path, write_gif(path, &episode, &camera, &clip)?),
        (None, None, Some(path)) => {
            let position = args.frame.unwrap_or(episode.frames.len() - 1);
            let frame = episode.frames.get(position).ok_or_else(|| {
                UsageError(format!("--frame {position}: the episode has frames 0 to {}", episode.frames.len() - 1))
            })?;
            write_png(path, &episode, &camera, frame, args.show)?;
            (path, Clip { size_px: camera.size_px, n_pictures: 1 })
        }
        (None, None, None) => return Err(UsageError("render needs one of --mp4, --gif, --png".to_owned()).into()),
    };
    let Clip { size_px: [width, height], n_pictures } = made;
    if args.json {
        output::print_json(&json!({
            "recording": file,
            "episode": args.episode,
            "camera": camera.name,
            "size_px": made.size_px,
            "pictures": n_pictures,
            "written": written,
        }))?;
    } else {
        let pictures = counted(n_pictures, "picture");
        output::print(&format!(
            "episode {} of {} ({pictures} of {width}x{height}) → {}",
            args.episode,
            file.display(),
            written.display()
        ))?;
    }
    Ok(CommandOutcome::Done)
}

/// The camera that is asked for: one of the recording's as it filmed, or drawing as finely as for people.
fn camera(args: &RenderArgs, filmed: &[CameraConfig]) -> anyhow::Result<CameraConfig> {
    let of_recording = filmed.iter().find(|camera| camera.name == args.camera);
    let for_people = |camera: CameraConfig| CameraConfig { quality: PictureQuality::Fine, ..camera };
    let mut camera = match (args.camera.as_str(), of_recording) {
        (_, Some(camera)) if args.as_filmed => camera.clone(),
        ("front", _) if !args.as_filmed => for_people(CameraConfig::new(Viewpoint::Front, SIZE_PX)),
        ("wrist", _) if !args.as_filmed => for_people(CameraConfig::new(Viewpoint::Wrist, SIZE_PX)),
        (_, Some(camera)) => for_people(CameraConfig { size_px: SIZE_PX, ..camera.clone() }),
        (name, None) => {
            let names: Vec<&str> = filmed.iter().map(|camera| camera.name.as_str()).collect();
            let own = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let problem =
                format!("--camera {name}: the recording's cameras are: {own}; front and wrist are drawn of any");
            return Err(UsageError(problem).into());
        }
    };
    if let Some(size) = &args.size {
        camera.size_px = size_px(size)?;
    }
    camera.check().map_err(|error| UsageError(error.to_string()))?;
    Ok(camera)
}

/// Width and height from `480` or `640x480`.
fn size_px(size: &str) -> Result<[u32; 2], UsageError> {
    let wrong = || UsageError(format!("--size {size}: one even number, or two as 640x480"));
    let (width, height) = size.split_once('x').unwrap_or((size, size));
    Ok([width.parse().map_err(|_error| wrong())?, height.parse().map_err(|_error| wrong())?])
}
