//! The desktop viewer: a window in which a scene is seen from all sides, and its glass changed.
//!
//! `App` takes events and draws; `worker` renders and `survey` measures, each on a thread of its own; `panels` are the windows within
//! the window, and `state` is what they change. What is on the screen is what `vitrum render` makes of the same options, pixel for pixel.

mod colors;
mod desk;
mod disk;
mod inspect;
mod meter;
mod orbit;
mod panels;
mod session;
mod state;
mod survey;
mod worker;

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::gpu::{Gpu, GpuError, Instance, Messages, OnScreen, Screen, Surface};
use crate::image::{ImageFormat, OutputFile};
use crate::options::RenderArgs;
use crate::passes;
use crate::plan::Plan;
use crate::{Error, Result};

use disk::Watch;
use session::{Action, Ask, Session};
use state::{Edits, State};
use survey::{Finding, Survey};
use worker::{News, Worker};

/// How long nothing has to change before the whole picture is made.
const REST: Duration = Duration::from_millis(120);

/// While pictures move, the window is drawn with each of them; without one it waits for so long.
const GAP: Duration = Duration::from_millis(60);

/// How often the viewer looks whether a file is written, and how long one has to be left alone to be read again.
const LOOK: Duration = Duration::from_millis(200);

/// Devices that may be lost within a minute.
const MOST_LOSSES: usize = 3;

/// What a viewer is started with.
pub struct Options {
    /// The scene; `None`: the built-in one.
    pub scene: Option<PathBuf>,
    /// Options of the pictures; the size is the window's, where none is given.
    pub args: RenderArgs,
}

/// Opens the window and runs until it is closed. Messages of the validation layer come back.
pub fn run(options: Options) -> Result<Vec<Arc<Messages>>> {
    let none = |error: winit::error::EventLoopError| {
        // Where in a library it was found does not help.
        let text = error.to_string();
        let told = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map(|(_, told)| told.to_owned());
        GpuError::NoWindow(told.unwrap_or(text))
    };
    let event_loop = EventLoop::<()>::with_user_event().build().map_err(none)?;
    event_loop.set_control_flow(ControlFlow::Wait);
    // What cannot be written is said before there is a window.
    options.args.stats.as_deref().map(OutputFile::new).transpose()?;
    let session = Session::new(options)?;
    let proxy = event_loop.create_proxy();
    let (messages, losses) = (Vec::new(), Vec::new());
    let mut app = App { session, shown: None, proxy, closes: false, end: Ok(()), messages, losses };
    event_loop.run_app(&mut app).map_err(none)?;
    let App { end, messages, shown, session, .. } = app;
    drop(shown);
    end?;
    if let Some(file) = &session.state.args.stats {
        let report = serde_json::to_string_pretty(&session.state.meter.report()).unwrap_or_default();
        OutputFile::new(file)?.write(report.as_bytes())?;
    }
    Ok(messages)
}

/// What there is while the window is open.
struct Shown {
    worker: Worker,
    survey: Survey,
    screen: Screen,
    egui: egui_winit::State,
    /// When something changed last, until the whole picture is asked for.
    changed: Option<Instant>,
    /// When it was that what was asked for last was asked for.
    asked: Instant,
    /// The first event that no frame has heard of yet.
    heard: Option<Instant>,
    drawn: Instant,
    next: Option<Instant>,
    /// The scene that the title names.
    named: String,
    /// A render of the picture into a file, and that.
    saving: Option<(Child, String)>,
    /// An eye on the scene's files.
    watch: Option<Watch>,
    /// When one of them changed.
    touched: Option<Instant>,
    window: Arc<Window>,
}

struct App {
    session: Session,
    shown: Option<Shown>,
    proxy: EventLoopProxy<()>,
    /// Whether the user wants to leave.
    closes: bool,
    /// How it ended.
    end: Result<()>,
    /// Those of each instance.
    messages: Vec<Arc<Messages>>,
    /// When devices were lost.
    losses: Vec<Instant>,
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Shown> {
        let attributes = Window::default_attributes().with_inner_size(LogicalSize::new(1280.0, 720.0));
        let window = event_loop.create_window(attributes).map_err(|error| GpuError::NoWindow(error.to_string()))?;
        self.open_in(Arc::new(window))
    }

    /// After a device was lost: everything on it anew, in the same window. One that is lost again and again is given up.
    fn recover(&mut self) -> Result<()> {
        self.losses.retain(|loss| loss.elapsed() < Duration::from_secs(60));
        let Some(mut before) = self.shown.take().filter(|_| self.losses.len() < MOST_LOSSES) else {
            return Err(Error::Gpu(GpuError::Lost));
        };
        self.losses.push(Instant::now());
        let memory = before.egui.egui_ctx().memory(Clone::clone);
        let window = before.window.clone();
        (self.session.state.pictures, self.session.placed) = ([None, None], Vec::new());
        let saving = before.saving.take();
        drop(before);
        self.session.forget();
        let shown = Shown { saving, ..self.open_in(window)? };
        shown.egui.egui_ctx().memory_mut(|all| *all = memory);
        self.session.state.notice = Some("the device was lost, and is there again".into());
        self.shown = Some(shown);
        Ok(())
    }

    fn open_in(&mut self, window: Arc<Window>) -> Result<Shown> {
        let state = &self.session.state;
        let validation = state.args.validation == Some(true);
        let instance = Instance::for_windows(validation, &*window)?;
        self.messages.extend(validation.then(|| instance.messages()));
        let surface = Surface::new(&instance, &window)?;
        let gpu = Gpu::open(&instance, instance.choose(state.args.device.as_deref())?)?;
        if state.sized {
            passes::check(&gpu, &Plan::new(&state.scene, &state.args)?)?;
        }
        let screen = Screen::new(&gpu, surface)?;
        let context = egui::Context::default();
        context.all_styles_mut(|style| {
            // Wide soft shadows cost more than all else that is drawn.
            style.visuals.window_shadow = egui::Shadow::NONE;
            style.text_styles.insert(egui::TextStyle::Small, egui::FontId::proportional(11.0));
        });
        let scale = Some(window.scale_factor() as f32);
        let side = Some(gpu.max_image_side() as usize);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &*window, scale, window.theme(), side);
        let wake = || {
            let proxy = self.proxy.clone();
            // A loop that has ended needs no news.
            move || {
                let _ = proxy.send_event(());
            }
        };
        let (worker, survey) = (worker::start(gpu.clone(), wake()), survey::start(gpu, wake()));
        window.request_redraw();
        let now = Instant::now();
        Ok(Shown {
            worker,
            survey,
            screen,
            egui,
            changed: Some(now),
            asked: now,
            heard: None,
            drawn: now,
            next: None,
            named: String::new(),
            saving: None,
            watch: None,
            touched: None,
            window,
        })
    }

    /// One frame: hears what there is, runs the panels, shows them.
    fn frame(&mut self) -> Result<()> {
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let session = &mut self.session;
        #[cfg(debug_assertions)]
        if is_lost_for_a_test(session.state.meter.frames(), self.losses.len()) {
            return Err(Error::Gpu(GpuError::Lost));
        }
        let start = Instant::now();
        let heard = shown.heard.take().unwrap_or(start);
        let timed = shown.hear(session)?;
        let input = shown.egui.take_egui_input(&shown.window);
        let mut edits = Edits::default();
        for file in &input.dropped_files {
            session.actions.push(Action::Open(file.path().to_path_buf()));
        }
        let context = shown.egui.egui_ctx().clone();
        let quit = egui::KeyboardShortcut::new(egui::Modifiers::COMMAND, egui::Key::Q);
        let mut closes = false;
        let output = context.run_ui(input, |ui| {
            closes |= ui.ctx().input_mut(|input| input.consume_shortcut(&quit));
            edits.add(panels::all(ui, session));
        });
        self.closes = closes;
        if edits.any() {
            (session.state.error, session.state.notice) = (None, None);
        }
        shown.look_at_files(session, &self.proxy);
        let said = |session: &Session| (session.state.error.clone(), session.state.notice.clone());
        let before = said(session);
        shown.act(session, &mut edits);
        if said(session) != before {
            // It was laid out before there was anything to say.
            shown.window.request_redraw();
        }
        shown.egui.handle_platform_output(&shown.window, output.platform_output);
        shown.screen.set_textures(output.textures_delta)?;
        shown.ask(session, edits, heard);
        // What moves is drawn with its next picture.
        let waits = (edits.scene || edits.model) && timed.is_none() && start.duration_since(shown.drawn) < GAP;
        if !waits {
            shown.name(&session.state.scene.name);
            let primitives = context.tessellate(output.shapes, output.pixels_per_point);
            let size = shown.window.inner_size();
            let size = [size.width, size.height];
            if shown.screen.draw(size, &session.placed, output.pixels_per_point, &primitives)? == OnScreen::Not {
                let size = shown.window.inner_size();
                if size.width > 0 && size.height > 0 {
                    shown.window.request_redraw();
                }
            }
            shown.drawn = Instant::now();
            session.state.meter.drew(shown.drawn.duration_since(start));
        }
        if let Some((asked, moving, stand_in)) = timed {
            session.state.meter.showed(asked, moving, stand_in);
        }
        let delay = output.viewport_output.values().map(|viewport| viewport.repaint_delay).min();
        let repaint = delay.filter(|_| !waits).and_then(|delay| Instant::now().checked_add(delay));
        let gap = waits.then(|| shown.drawn + GAP);
        let saved = shown.saving.is_some().then(|| Instant::now() + LOOK);
        let touched = shown.touched.map(|touched| touched + LOOK);
        shown.next =
            [repaint, gap, saved, touched, shown.changed.map(|changed| changed + REST)].into_iter().flatten().min();
        Ok(())
    }
}

impl Shown {
    /// Takes in what the threads have to say; of the last picture when it was asked for, whether things moved, and whether it stands in.
    fn hear(&mut self, session: &mut Session) -> Result<Option<(Instant, bool, bool)>> {
        let state = &mut session.state;
        let mut timed = None;
        for news in self.worker.news() {
            match news {
                News::Picture(picture) => {
                    let number = picture.number;
                    if number == 0 {
                        timed = Some((picture.asked, picture.moving, picture.stand_in));
                        state.progress = None;
                        if !picture.stand_in {
                            session.cost.keep(&picture);
                        }
                    }
                    state.pictures[number] = Some(picture);
                }
                News::Progress(share) => state.progress = Some(share),
                News::Failed(error) => state.error = Some(error),
                News::Lost => return Err(Error::Gpu(GpuError::Lost)),
            }
        }
        for finding in self.survey.news() {
            match finding {
                Finding::Error(revision, measured) => session.cost.error = Some((revision, measured)),
                Finding::NoError(revision, why) => session.cost.no_error = Some((revision, why)),
                Finding::Offers(revision, offers) => session.cost.offers = Some((revision, offers)),
                Finding::Pixel(revision, inspection) => session.pixel.inspection = Some((revision, inspection)),
                Finding::Failed(error) => state.error = Some(error),
                Finding::Lost => return Err(Error::Gpu(GpuError::Lost)),
            }
        }
        if let Some((child, _)) = &mut self.saving
            && let Ok(Some(_)) = child.try_wait()
            && let Some((child, file)) = self.saving.take()
        {
            match child.wait_with_output() {
                Ok(output) if output.status.success() => {
                    (state.error, state.notice) = (None, Some(format!("saved {file}")));
                }
                Ok(output) => {
                    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
                    let said = said.strip_prefix("error: ").unwrap_or(&said);
                    state.error =
                        Some(if said.is_empty() { format!("{file}: {}", output.status) } else { said.into() });
                }
                Err(error) => state.error = Some(format!("{file}: {error}")),
            }
        }
        if self.worker.is_over() || self.survey.is_over() {
            // A thread that panicked; with all the rest it is made anew.
            return Err(Error::Gpu(GpuError::Lost));
        }
        Ok(timed)
    }

    /// Puts what is open into the window's title.
    fn name(&mut self, scene: &str) {
        if self.named != scene {
            self.named = scene.to_owned();
            self.window.set_title(&format!("{scene} - Vitrum"));
        }
    }

    /// Reads the scene again where one of its files changed, once whoever writes it is done.
    fn look_at_files(&mut self, session: &mut Session, proxy: &EventLoopProxy<()>) {
        let files = &session.state.scene.files;
        if !self.watch.as_ref().is_some_and(|watch| watch.is_of(files)) {
            let proxy = proxy.clone();
            let wake = move || {
                let _ = proxy.send_event(());
            };
            self.watch = Some(Watch::new(files, wake));
        }
        if self.watch.as_ref().is_some_and(Watch::take) {
            self.touched = Some(Instant::now());
        }
        if self.touched.is_some_and(|touched| touched.elapsed() >= LOOK) {
            self.touched = None;
            session.actions.push(Action::Reload);
        }
    }

    /// Does what the panels asked for.
    fn act(&mut self, session: &mut Session, edits: &mut Edits) {
        for action in std::mem::take(&mut session.actions) {
            let state = &mut session.state;
            match action {
                Action::Open(path) => {
                    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
                    let opened = match extension.as_deref() {
                        Some("exr" | "hdr" | "png" | "jpg" | "jpeg") => state.surround(path),
                        _ => {
                            let opened = state.open(path.clone());
                            if opened {
                                session.recent.add(&path);
                            }
                            opened
                        }
                    };
                    edits.scene |= opened;
                }
                Action::Reload => edits.scene |= state.reload(),
                Action::Revert => {
                    state.revert();
                    edits.scene = true;
                }
                Action::Copy => {
                    self.egui.egui_ctx().copy_text(state.command());
                    (state.error, state.notice) = (None, Some("the command is on the clipboard".into()));
                }
                Action::Save if self.saving.is_some() => state.error = Some("another picture is being saved".into()),
                Action::Save => match save(state) {
                    Ok(child) => {
                        self.saving = Some((child, state.output.clone()));
                        (state.error, state.notice) = (None, Some(format!("rendering {} ...", state.output)));
                    }
                    Err(error) => state.error = Some(error.in_full()),
                },
            }
        }
    }

    /// Asks the threads for what is to be seen and known.
    fn ask(&mut self, session: &mut Session, edits: Edits, heard: Instant) {
        let pixel = session.pixel.pixel.filter(|_| session.pixel.is_open);
        let now = Instant::now();
        if edits.scene || edits.model {
            (self.changed, self.asked) = (Some(now), heard);
            session.state.revision += 1;
            session.state.scene_revision += u64::from(edits.scene);
            session.forget();
            // What moves has the device for itself.
            self.survey.stop();
            let wanted = session.state.wanted(heard, /* moving: */ true);
            self.worker.want(wanted);
            return;
        }
        let rests = self.changed.is_some_and(|changed| now.duration_since(changed) >= REST);
        session.state.beside_revision += u64::from(edits.beside);
        if rests || edits.look || edits.beside {
            let asked = if rests { self.asked } else { heard };
            let wanted = session.state.wanted(asked, /* moving: */ false);
            self.worker.want(worker::Wanted { pixel, ..wanted });
            self.changed = self.changed.filter(|_| !rests);
        }
        if self.changed.is_none() {
            match session.query() {
                Some(Ask::Query(query)) => self.survey.want(*query),
                Some(Ask::Nothing) => self.survey.stop(),
                None => {}
            }
        }
    }
}

/// Whether a test wants a device to be lost now: after so many frames, so often.
#[cfg(debug_assertions)]
fn is_lost_for_a_test(frames: u64, losses: usize) -> bool {
    let wish = std::env::var("VITRUM_LOSE_DEVICE").unwrap_or_default();
    let (often, after) = wish.split_once('x').unwrap_or_default();
    let number = |text: &str| text.parse::<u64>().unwrap_or(0);
    losses < number(often) as usize && frames >= number(after) * (losses as u64 + 1)
}

/// Starts the render that the command names, which leaves the picture in its file.
fn save(state: &State) -> Result<Child> {
    ImageFormat::of(state.output.as_ref())?;
    let program = std::env::current_exe().map_err(|error| Error::file("vitrum", "find", error))?;
    let mut command = Command::new(&program);
    command.arg("render").args(state.options()).arg("-q").arg(format!("-o={}", state.output));
    command.args(state.scene_word());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().map_err(|error| Error::file(program, "start", error))
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
            let drawn = match self.frame() {
                Err(Error::Gpu(GpuError::Lost)) => self.recover(),
                other => other,
            };
            if let Err(error) = drawn {
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
        // The threads first, then what is drawn on, then the window; no picture outlives its device.
        (self.session.state.pictures, self.session.placed) = ([None, None], Vec::new());
        self.shown = None;
    }
}

/// A drag on the picture in heights of it.
fn heights(drag: egui::Vec2, height: f32) -> DVec2 {
    DVec2::new((drag.x / height).into(), (drag.y / height).into())
}
