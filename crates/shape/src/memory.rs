//! Memory that the program may take: that which is free, and what is left of the limits of its
//! control groups and of the process, by which containers and batch systems bound a job.

use std::fs::read_to_string;
use std::path::Path;

/// Returns the memory available without swapping [bytes], if the operating system reports it
/// (Linux).
pub fn available_memory() -> Option<u64> {
    let text = |path: &str| read_to_string(path).unwrap_or_default();
    let free = mem_available(&text("/proc/meminfo"));
    let left = left_in_groups(&text("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    let in_process = left_in_process(&text("/proc/self/limits"), &text("/proc/self/status"));
    [free, left, in_process].into_iter().flatten().min()
}

/// Limits of a process (`ulimit -v`, `ulimit -d`), and their use in /proc/self/status.
const OF_PROCESS: [[&str; 2]; 2] = [["Max address space", "VmSize:"], ["Max data size", "VmData:"]];

/// Returns the least memory that is left [bytes] of the limits of the process, from the texts of
/// /proc/self/limits and /proc/self/status.
fn left_in_process(limits: &str, status: &str) -> Option<u64> {
    let left = |[limit, used]: [&str; 2]| {
        let mut soft = limits.lines().find_map(|line| line.strip_prefix(limit))?.split_whitespace();
        let soft: u64 = soft.next()?.parse().ok()?;
        let used = status.lines().find_map(|line| line.strip_prefix(used))?;
        let kib: u64 = used.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(soft.saturating_sub(kib * 1024))
    };
    OF_PROCESS.into_iter().filter_map(left).min()
}

/// Parses the available memory [bytes] from the text of /proc/meminfo.
fn mem_available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

/// Files with the limit and the use of a control group [bytes], and key of the file cache in
/// `memory.stat`, which the kernel frees before it stops a process: versions 2 and 1.
const FILES: [[&str; 3]; 2] = [
    ["memory.max", "memory.current", "inactive_file"],
    ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"],
];

/// Returns the least memory that is left [bytes] in a control group of the process and in those
/// around it; `groups` is the text of /proc/self/cgroup.
fn left_in_groups(groups: &str, root: &Path) -> Option<u64> {
    let of_line = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        let (root, files) = match controllers {
            "" => (root.to_owned(), FILES[0]),
            list if list.split(',').any(|name| name == "memory") => (root.join("memory"), FILES[1]),
            _ => return None,
        };
        let group = root.join(path.trim_start_matches('/'));
        let around = group.ancestors().take_while(|group| group.starts_with(&root));
        around.filter_map(|group| left(group, files)).min()
    };
    groups.lines().filter_map(of_line).min()
}

/// Returns the memory left in one group [bytes], if it has a limit.
fn left(group: &Path, [limit, used, cache]: [&str; 3]) -> Option<u64> {
    let number = |name| read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let (limit, used) = (number(limit)?, number(used)?);
    let stat = read_to_string(group.join("memory.stat")).unwrap_or_default();
    let value = |line: &str| line.strip_prefix(cache)?.strip_prefix(' ')?.trim().parse().ok();
    let cache: u64 = stat.lines().find_map(value).unwrap_or(0);
    Some(limit.saturating_sub(used.saturating_sub(cache)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir_all, write};

    #[test]
    fn available_memory_is_read_from_meminfo() {
        let text = "MemTotal:       24000000 kB\nMemAvailable:    4000000 kB\nSwapFree: 0 kB\n";
        assert_eq!(mem_available(text), Some(4_096_000_000));
        assert_eq!(mem_available("MemTotal: 24000000 kB\n"), None);
        assert_eq!(mem_available("MemAvailable: many kB\n"), None);
    }

    #[test]
    fn limits_of_the_process_count() {
        let status = "VmPeak:\t  9000 kB\nVmSize:\t    1000 kB\nVmData:\t     200 kB\n";
        let limits = |space: &str, data: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units\n\
                 Max data size             {data}            unlimited            bytes\n\
                 Max address space         {space}            unlimited            bytes\n"
            )
        };
        let left = |space, data| left_in_process(&limits(space, data), status);
        assert_eq!(left("unlimited", "unlimited"), None);
        assert_eq!(left("2048000", "unlimited"), Some(1_024_000));
        assert_eq!(left("2048000", "1228800"), Some(1_024_000));
        assert_eq!(left("2048000", "1024000"), Some(819_200));
        assert_eq!(left("4096", "unlimited"), Some(0));
        assert_eq!(left_in_process("", ""), None);
    }

    #[test]
    fn the_tightest_control_group_counts() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let group = |path: &str, files: [(&str, &str); 3]| {
            create_dir_all(root.join(path)).unwrap();
            for (name, text) in files {
                write(root.join(path).join(name), text).unwrap();
            }
        };
        let version_2 = |path: &str, limit: &str| {
            let stat = ("memory.stat", "anon 1\ninactive_file 200\n");
            group(path, [("memory.max", limit), ("memory.current", "700\n"), stat]);
        };
        version_2("slurm", "1000\n");
        version_2("slurm/job/step", "max\n");
        assert_eq!(left_in_groups("0::/slurm/job/step\n", root), Some(500));
        version_2("slurm/job", "600\n");
        assert_eq!(left_in_groups("0::/slurm/job/step\n", root), Some(100));
        assert_eq!(left_in_groups("0::/other\n", root), None);
        let limit = ("memory.limit_in_bytes", "50\n");
        group("memory/box", [limit, ("memory.usage_in_bytes", "80\n"), ("memory.stat", "")]);
        assert_eq!(left_in_groups("5:cpu:/\n4:memory:/box\n0::/slurm/job\n", root), Some(0));
    }
}
