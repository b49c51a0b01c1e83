//! Processes that may crash or hang: started, listened to, and ended in time.

use std::io::{self, BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How often a process is asked whether it has ended.
const LOOK: Duration = Duration::from_millis(5);

/// Waits, and kills what takes longer than `patience`: `None` then.
pub fn end_within(child: &mut Child, patience: Duration) -> io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if start.elapsed() >= patience {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(LOOK);
    }
}

/// What a command prints, and how it ends; `None` where that takes longer than `patience`.
pub fn output_within(command: &mut Command, patience: Duration) -> io::Result<Option<Output>> {
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let (stdout, stderr) = (child.stdout.take().map(all_of), child.stderr.take().map(all_of));
    let status = end_within(&mut child, patience)?;
    let all = |reader: Option<JoinHandle<Vec<u8>>>| reader.and_then(|reader| reader.join().ok()).unwrap_or_default();
    Ok(status.map(|status| Output { status, stdout: all(stdout), stderr: all(stderr) }))
}

/// Reads on another thread, to the end.
pub fn all_of(mut pipe: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        // What was read before an error is what there is.
        let _ = pipe.read_to_end(&mut bytes);
        bytes
    })
}

/// Lines, whatever bytes they are of, until the end or an error.
pub fn lines_of(pipe: impl Read) -> impl Iterator<Item = String> {
    let mut pipe = BufReader::new(pipe);
    std::iter::from_fn(move || {
        let mut line = Vec::new();
        let read = pipe.read_until(b'\n', &mut line).ok()?;
        (read > 0).then(|| String::from_utf8_lossy(&line).trim_end().to_owned())
    })
}

/// From now on this process ends with the one that started it, where the system can see to that.
pub fn end_with_parent() {
    // Where it cannot, the end of standard input has to do.
    #[cfg(target_os = "linux")]
    let _ = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn what_takes_too_long_is_ended() {
        let shell = |script: &str, seconds| {
            output_within(Command::new("sh").args(["-c", script]), Duration::from_secs_f64(seconds)).expect("it starts")
        };
        let start = Instant::now();
        assert!(shell("exec sleep 60", 0.05).is_none() && start.elapsed() < Duration::from_secs(30));
        let output = shell("printf a; exit 3", 60.0).expect("it ends");
        assert_eq!((output.status.code(), &output.stdout[..]), (Some(3), &b"a"[..]));
    }

    #[test]
    fn bytes_that_are_no_text_end_no_lines() {
        assert_eq!(lines_of(&b"a\n\xff\xfe\nb"[..]).collect::<Vec<_>>(), ["a", "\u{fffd}\u{fffd}", "b"]);
    }
}
