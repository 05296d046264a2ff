//! Memory and disk space of this machine.

use std::path::Path;

/// Free space for this user on the file system of `folder`, bytes; `None` if the system does not report it.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(target_os = "linux")]
    {
        let space = rustix::fs::statvfs(folder).ok()?;
        space.f_bavail.checked_mul(space.f_frsize)
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = folder;
        None
    }
}

/// Peak resident memory of this process, MiB; `None` on systems other than Linux.
pub(super) fn peak_rss_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    #[test]
    fn linux_reports_a_plausible_peak() {
        let is_reported = std::path::Path::new("/proc/self/status").exists();
        assert_eq!(super::peak_rss_mib().is_some_and(|mib| mib > 1.0), is_reported);
    }
}
