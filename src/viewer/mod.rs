//! The desktop viewer: a window in which a scene is seen from all sides, and its glass changed.
//!
//! `App` takes events and draws; `worker` renders on a thread of its own; `panels` are the windows within the window. What is on the
//! screen is what `vitrum render` makes of the same options, pixel for pixel.

mod desk;
mod meter;
mod orbit;
mod panels;
mod worker;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::gpu::{Gpu, GpuError, Instance, Messages, OnScreen, Screen, Surface};
use crate::image::OutputFile;
use crate::options::{RenderArgs, Size};
use crate::scene::{Camera, Overrides, Scene};
use crate::{Error, Result};

use meter::Meter;
use worker::{News, Picture, Wanted, Worker};

/// How long nothing has to change before the whole picture is made.
const REST: Duration = Duration::from_millis(120);

/// What a viewer is started with.
pub struct Options {
    /// The scene; `None`: the built-in one.
    pub scene: Option<PathBuf>,
    /// Options of the pictures; the size is the window's, where none is given.
    pub args: RenderArgs,
}

/// Opens the window and runs until it is closed. Messages of the validation layer come back.
pub fn run(options: Options) -> Result<Option<Arc<Messages>>> {
    let none = |error: winit::error::EventLoopError| GpuError::NoWindow(error.to_string());
    let event_loop = EventLoop::<()>::with_user_event().build().map_err(none)?;
    event_loop.set_control_flow(ControlFlow::Wait);
    let state = State::new(options)?;
    let mut app =
        App { state, shown: None, proxy: event_loop.create_proxy(), closes: false, end: Ok(()), messages: None };
    event_loop.run_app(&mut app).map_err(none)?;
    let App { end, messages, shown, state, .. } = app;
    drop(shown);
    end?;
    if let Some(file) = &state.args.stats {
        let report = serde_json::to_string_pretty(&state.meter.report()).unwrap_or_default();
        OutputFile::new(file)?.write(report.as_bytes())?;
    }
    Ok(messages)
}

/// What is looked at, and how.
struct State {
    path: Option<PathBuf>,
    scene: Scene,
    args: RenderArgs,
    /// Whether the size was given; else it is the window's.
    sized: bool,
    /// What went wrong last, until something else is asked for.
    error: Option<String>,
    picture: Option<Picture>,
    /// Counts what is looked at: it grows with every change but those of the look.
    revision: u64,
    meter: Meter,
}

impl State {
    fn new(Options { scene: path, args }: Options) -> Result<Self> {
        let scene = Scene::load(path.as_deref(), &Overrides::of(&args))?;
        let args = args.or(scene.render.clone());
        let sized = args.size.is_some();
        Ok(Self { path, sized, scene, args, error: None, picture: None, revision: 0, meter: Meter::default() })
    }

    /// Another scene in the place of this one; what cannot be read leaves it, and is said.
    fn open(&mut self, path: PathBuf) -> bool {
        let args = RenderArgs { ior: None, roughness: None, env: None, size: None, ..self.args.clone() };
        let size = self.args.size.filter(|_| self.sized);
        match Self::new(Options { scene: Some(path), args: RenderArgs { size, ..args } }) {
            Ok(state) => {
                let (picture, meter) = (self.picture.take(), std::mem::take(&mut self.meter));
                *self = Self { picture, meter, revision: self.revision, ..state };
            }
            Err(error) => self.error = Some(error.in_full()),
        }
        self.error.is_none()
    }

    /// Another environment, if it can be read.
    fn surround(&mut self, path: PathBuf) -> bool {
        let overrides = Overrides { environment: Some(path.clone()), ..Overrides::default() };
        match Scene::load(self.path.as_deref(), &overrides) {
            Ok(scene) => {
                self.scene.environment = scene.environment;
                self.args.env = Some(path);
                self.error = None;
            }
            Err(error) => self.error = Some(error.in_full()),
        }
        self.error.is_none()
    }

    fn size(&self) -> Size {
        self.args.size.unwrap_or(Size { width: 1, height: 1 })
    }
}

/// What there is while the window is open.
struct Shown {
    worker: Worker,
    screen: Screen,
    egui: egui_winit::State,
    texture: Option<egui::TextureId>,
    /// When something changed last, until the whole picture is asked for.
    changed: Option<Instant>,
    /// When it was that what was asked for last was asked for.
    asked: Instant,
    /// The first event that no frame has heard of yet.
    heard: Option<Instant>,
    next: Option<Instant>,
    window: Arc<Window>,
}

struct App {
    state: State,
    shown: Option<Shown>,
    proxy: EventLoopProxy<()>,
    /// Whether the user wants to leave.
    closes: bool,
    /// How it ended.
    end: Result<()>,
    messages: Option<Arc<Messages>>,
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Shown> {
        let title = format!("{} - Vitrum", self.state.scene.name);
        let attributes =
            Window::default_attributes().with_title(title).with_inner_size(LogicalSize::new(1280.0, 720.0));
        let window = event_loop.create_window(attributes).map_err(|error| GpuError::NoWindow(error.to_string()))?;
        let window = Arc::new(window);
        let validation = self.state.args.validation == Some(true);
        let instance = Instance::for_windows(validation, &*window)?;
        self.messages = validation.then(|| instance.messages());
        let surface = Surface::new(&instance, &window)?;
        let gpu = Gpu::open(&instance, instance.choose(self.state.args.device.as_deref())?)?;
        let screen = Screen::new(&gpu, surface)?;
        let context = egui::Context::default();
        let scale = Some(window.scale_factor() as f32);
        let side = Some(gpu.max_image_side() as usize);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &*window, scale, window.theme(), side);
        let proxy = self.proxy.clone();
        // A loop that has ended needs no news.
        let worker = worker::start(gpu, move || {
            let _ = proxy.send_event(());
        });
        window.request_redraw();
        let now = Instant::now();
        Ok(Shown {
            worker,
            screen,
            egui,
            texture: None,
            changed: Some(now),
            asked: now,
            heard: None,
            next: None,
            window,
        })
    }

    /// One frame: hears what there is, runs the panels, shows them.
    fn frame(&mut self) -> Result<()> {
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let start = Instant::now();
        let heard = shown.heard.take().unwrap_or(start);
        let mut new = None;
        for news in shown.worker.news() {
            match news {
                News::Picture(picture) => new = Some(picture),
                News::Failed(error) => self.state.error = Some(error),
                News::Lost => return Err(Error::Gpu(GpuError::Lost)),
            }
        }
        let timed = new.as_ref().map(|picture| (picture.asked, picture.moving, picture.size != picture.whole));
        if let Some(picture) = new {
            shown.texture = Some(shown.screen.set_picture(picture.number, picture.image.clone())?);
            self.state.picture = Some(picture);
        }
        let input = shown.egui.take_egui_input(&shown.window);
        let dropped: Vec<_> = input.dropped_files.iter().map(|file| file.path().to_path_buf()).collect();
        let (state, texture) = (&mut self.state, shown.texture);
        let mut changes = false;
        for path in dropped {
            let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
            changes |= match extension.as_deref() {
                Some("exr" | "hdr" | "png" | "jpg" | "jpeg") => state.surround(path),
                _ => state.open(path),
            };
        }
        let context = shown.egui.egui_ctx().clone();
        let mut edits = false;
        let output = context.run_ui(input, |ui| edits |= panels::all(ui, state, texture));
        if edits {
            state.error = None;
            changes = true;
        }
        shown.egui.handle_platform_output(&shown.window, output.platform_output);
        shown.screen.set_textures(output.textures_delta)?;
        self.closes = context.input(|input| input.modifiers.command && input.key_pressed(egui::Key::Q));
        let primitives = context.tessellate(output.shapes, output.pixels_per_point);
        if shown.screen.draw(output.pixels_per_point, &primitives)? == OnScreen::Not {
            let size = shown.window.inner_size();
            if size.width > 0 && size.height > 0 {
                shown.window.request_redraw();
            }
        }
        let now = Instant::now();
        state.meter.drew(now.duration_since(start));
        if let Some((asked, moving, stand_in)) = timed {
            state.meter.showed(asked, moving, stand_in);
        }
        if changes {
            (shown.changed, shown.asked) = (Some(now), heard);
            state.revision += 1;
            shown.worker.want(state.wanted(heard, /* moving: */ true));
        } else if shown.changed.is_some_and(|changed| now.duration_since(changed) >= REST) {
            shown.changed = None;
            shown.worker.want(state.wanted(shown.asked, /* moving: */ false));
        }
        let delay = output.viewport_output.values().map(|viewport| viewport.repaint_delay).min();
        let repaint = delay.and_then(|delay| now.checked_add(delay));
        shown.next = [repaint, shown.changed.map(|changed| changed + REST)].into_iter().flatten().min();
        Ok(())
    }
}

impl State {
    fn wanted(&self, asked: Instant, moving: bool) -> Wanted {
        let mut scene = self.scene.clone();
        let size = self.size();
        scene.frame(f64::from(size.width) / f64::from(size.height));
        Wanted { revision: self.revision, scene, shots: vec![self.args.clone()], moving, asked }
    }

    fn drag(&mut self, by: impl FnOnce(Camera) -> Camera) {
        let size = self.size();
        self.scene.frame(f64::from(size.width) / f64::from(size.height));
        self.scene.framed = false;
        let camera = by(self.scene.camera);
        if Camera::new(camera.position, camera.target, camera.up, camera.vertical_fov).is_ok() {
            self.scene.camera = camera;
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            match self.open(event_loop) {
                Ok(shown) => self.shown = Some(shown),
                Err(error) => {
                    self.end = Err(error);
                    event_loop.exit();
                }
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        if let Some(shown) = &self.shown {
            shown.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if event == WindowEvent::RedrawRequested {
            if let Err(error) = self.frame() {
                self.end = Err(error);
                event_loop.exit();
            }
            if self.closes {
                event_loop.exit();
            }
            return;
        }
        let Some(shown) = &mut self.shown else { return };
        if shown.egui.on_window_event(&shown.window, &event).repaint {
            shown.heard.get_or_insert_with(Instant::now);
            shown.window.request_redraw();
        }
        if event == WindowEvent::CloseRequested {
            event_loop.exit();
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(shown) = &mut self.shown else { return };
        let now = Instant::now();
        if shown.next.is_some_and(|next| next <= now) {
            shown.next = None;
            shown.window.request_redraw();
        }
        event_loop.set_control_flow(shown.next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // The worker first, then what is drawn on, then the window.
        self.shown = None;
    }
}

/// A drag on the picture in heights of it.
fn heights(drag: egui::Vec2, height: f32) -> DVec2 {
    DVec2::new((drag.x / height).into(), (drag.y / height).into())
}
