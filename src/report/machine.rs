//! Names the machine that a report was made on.

use std::thread::available_parallelism;

/// Returns the processor's name, where the system tells it, the number of threads that it runs at once, and the system.
pub(super) fn machine() -> String {
    let threads = available_parallelism().map_or(1, std::num::NonZero::get);
    let facts = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let mut parts: Vec<String> = processor(&facts).map(str::to_string).into_iter().collect();
    parts.push(format!("{threads} {}", if threads == 1 { "thread" } else { "threads" }));
    parts.push(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH));
    parts.join(", ")
}

/// Finds the processor's name in the text that Linux gives about it.
fn processor(facts: &str) -> Option<&str> {
    let names = facts.lines().filter_map(|line| line.strip_prefix("model name")?.split_once(':'));
    names.map(|(_, name)| name.trim()).find(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named_where_the_system_tells_its_name() {
        assert_eq!(
            processor("processor\t: 0\nmodel name\t: A CPU @ 2 GHz\nflags\t: x\nmodel name\t: B\n"),
            Some("A CPU @ 2 GHz")
        );
        assert_eq!(processor("model name\n"), None);
        assert_eq!(processor(""), None);
    }
}
