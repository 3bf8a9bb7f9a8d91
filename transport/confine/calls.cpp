#include "transport/confine/calls.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <span>

namespace farfeel::transport {
namespace {

#ifdef FARFEEL_SANITIZED
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

/// What takes over a machine, or reaches far into its kernel, and is called by nothing here. By name: libseccomp knows
/// those that the headers of this kernel do not; one that it does not know is not there to be called.
constexpr const char* kTakesOver[] = {"execve",
                                      "execveat",  // other programs
                                      "process_vm_readv",
                                      "process_vm_writev",
                                      "pidfd_getfd",
                                      "kcmp",  // other processes
                                      "mount",
                                      "umount2",
                                      "pivot_root",
                                      "chroot",
                                      "move_mount",
                                      "open_tree",
                                      "fsopen",
                                      "fsconfig",
                                      "fsmount",
                                      "fspick",
                                      "mount_setattr",
                                      "unshare",
                                      "setns",
                                      "open_by_handle_at",
                                      "name_to_handle_at",  // another view of the machine
                                      "setuid",
                                      "setgid",
                                      "setreuid",
                                      "setregid",
                                      "setresuid",
                                      "setresgid",
                                      "setfsuid",
                                      "setfsgid",
                                      "setgroups",
                                      "capset",
                                      "init_module",
                                      "finit_module",
                                      "delete_module",
                                      "kexec_load",
                                      "kexec_file_load",
                                      "bpf",
                                      "userfaultfd",
                                      "io_uring_setup",
                                      "io_uring_enter",
                                      "io_uring_register",  // calls that no filter sees
                                      "add_key",
                                      "request_key",
                                      "keyctl",
                                      "iopl",
                                      "ioperm",
                                      "reboot",
                                      "swapon",
                                      "swapoff",
                                      "acct",
                                      "quotactl",
                                      "settimeofday",
                                      "clock_settime",
                                      "adjtimex",
                                      "clock_adjtime",
                                      "sethostname",
                                      "setdomainname",
                                      "syslog",
                                      "vhangup"};
/// Likewise; but sanitizers trace their own process at its end, and drivers count cycles.
constexpr const char* kTraces[] = {"ptrace", "perf_event_open"};

/// Allowed with any arguments. Some are not made on every machine: the C library chooses.
constexpr const char* kServerCalls[] = {
    // files and descriptors that are open
    "read", "readv", "pread64", "write", "writev", "pwrite64", "fdatasync", "close", "lseek", "fcntl", "dup", "fstat",
    "newfstatat", "stat", "lstat", "statx", "getdents64", "access", "faccessat", "faccessat2", "readlink", "readlinkat",
    "getcwd", "eventfd2", "pipe2",
    // waiting
    "poll", "ppoll", "select", "pselect6", "epoll_create1", "epoll_ctl", "epoll_wait", "epoll_pwait", "timerfd_create",
    "timerfd_settime", "nanosleep", "clock_nanosleep", "futex", "sched_yield", "restart_syscall",
    // datagrams
    "bind", "connect", "getsockname", "getpeername", "setsockopt", "getsockopt", "shutdown", "sendto", "sendmsg",
    "sendmmsg", "recvfrom", "recvmsg", "recvmmsg",
    // memory
    "munmap", "mremap", "brk", "madvise", "mlock", "mlock2", "munlock", "msync", "mincore",
    // threads and signals of this process
    "exit", "exit_group", "set_robust_list", "get_robust_list", "rseq", "set_tid_address", "membarrier", "gettid",
    "getpid", "getppid", "rt_sigaction", "rt_sigprocmask", "rt_sigreturn", "rt_sigtimedwait", "rt_sigpending",
    "sigaltstack", "sched_getaffinity", "sched_getscheduler", "sched_getparam", "getpriority", "getcpu",
    // time, and who and where this is
    "clock_gettime", "clock_getres", "gettimeofday", "time", "getrandom", "uname", "sysinfo", "getrusage", "times",
    "getuid", "geteuid", "getgid", "getegid", "getgroups"};

constexpr const char* kAnswererCalls[] = {
    "close", "exit",       "exit_group",   "munmap",         "mremap",        "brk",    "madvise", "futex",
    "fstat", "newfstatat", "rt_sigreturn", "rt_sigprocmask", "clock_gettime", "gettid", "getpid",  "getrandom"};

class Filter {
 public:
  explicit Filter(std::uint32_t otherwise) : context_(seccomp_init(otherwise), &seccomp_release) {
    demand(context_ ? 0 : -ENOMEM);
  }

  /// Rules for one call add up: it is enough that one fits.
  void add(std::uint32_t action, const char* call, std::initializer_list<scmp_arg_cmp> arguments = {}) {
    const int number = seccomp_syscall_resolve_name(call);
    // A call that this processor has not, or that libseccomp does not know, cannot be told apart: it has no rule.
    if (number < 0 || error_ != 0) return;
    demand(seccomp_rule_add_array(context_.get(), action, number, static_cast<unsigned>(arguments.size()),
                                  arguments.begin()));
  }
  void add_all(std::uint32_t action, std::span<const char* const> calls) {
    for (const char* call : calls) add(action, call);
  }
  /// 0, or a negative errno. On all threads at once.
  int load() {
    demand(error_ != 0 ? error_ : seccomp_attr_set(context_.get(), SCMP_FLTATR_CTL_TSYNC, 1));
    demand(error_ != 0 ? error_ : seccomp_attr_set(context_.get(), SCMP_FLTATR_CTL_OPTIMIZE, 2));  // a search tree
    return error_ != 0 ? error_ : seccomp_load(context_.get());
  }

 private:
  void demand(int result) {
    if (error_ == 0 && result < 0) error_ = result;
  }
  std::unique_ptr<void, void (*)(scmp_filter_ctx)> context_;
  int error_ = 0;
};

constexpr scmp_arg_cmp has_none(unsigned argument, std::uint64_t bits) {
  return {argument, SCMP_CMP_MASKED_EQ, bits, 0};
}
constexpr scmp_arg_cmp has_all(unsigned argument, std::uint64_t bits) {
  return {argument, SCMP_CMP_MASKED_EQ, bits, bits};
}
constexpr scmp_arg_cmp is(unsigned argument, std::uint64_t value) {
  return {argument, SCMP_CMP_EQ, value, 0};
}

/// Memory that is no code: what came as data is never run.
void allow_data(Filter& filter) {
  filter.add(SCMP_ACT_ALLOW, "mmap", {has_none(2, PROT_EXEC)});
  filter.add(SCMP_ACT_ALLOW, "mprotect", {has_none(2, PROT_EXEC)});
}

void allow_what_servers_do(Filter& filter) {
  filter.add_all(SCMP_ACT_ALLOW, kServerCalls);
  allow_data(filter);
  // Threads; clone3 hides its flags from filters, and its absence makes the C library take clone.
  filter.add(SCMP_ACT_ALLOW, "clone", {has_all(0, CLONE_VM | CLONE_SIGHAND | CLONE_THREAD)});
  const auto self = static_cast<std::uint64_t>(::getpid());
  filter.add(SCMP_ACT_ALLOW, "tgkill", {is(0, self)});  // abort()
  filter.add(SCMP_ACT_ALLOW, "prctl", {is(0, PR_SET_NAME)});
  filter.add(SCMP_ACT_ALLOW, "prlimit64", {is(0, 0), is(2, 0)});  // looks at limits
  filter.add(SCMP_ACT_ALLOW, "ioctl", {is(1, 0x541B)});           // FIONREAD
  filter.add(SCMP_ACT_ERRNO(ENOTTY), "ioctl", {is(1, 0x5401)});   // TCGETS: whether this is a terminal
  // UDP.
  for (const std::uint64_t family : {AF_INET, AF_INET6})
    filter.add(SCMP_ACT_ALLOW, "socket", {is(0, family), {1, SCMP_CMP_MASKED_EQ, 0xF, SOCK_DGRAM}});
  // Files are read; a list of operators is opened again whenever it was changed.
  constexpr std::uint64_t kChanges = O_CREAT | O_TRUNC;
  filter.add(SCMP_ACT_ALLOW, "openat", {has_none(2, O_ACCMODE | kChanges)});
  filter.add(SCMP_ACT_ALLOW, "open", {has_none(1, O_ACCMODE | kChanges)});
  for (const std::uint64_t writes : {O_WRONLY, O_RDWR}) {
    filter.add(SCMP_ACT_ERRNO(EACCES), "openat", {{2, SCMP_CMP_MASKED_EQ, O_ACCMODE, writes}});
    filter.add(SCMP_ACT_ERRNO(EACCES), "open", {{1, SCMP_CMP_MASKED_EQ, O_ACCMODE, writes}});
  }
}

Filter filter_of(Calls calls) {
  if (kIsSanitized || calls == Calls::kServerWithDriver) {
    Filter filter(SCMP_ACT_ALLOW);
    filter.add_all(SCMP_ACT_ERRNO(EPERM), kTakesOver);
    if (!kIsSanitized) filter.add_all(SCMP_ACT_ERRNO(EPERM), kTraces);
    return filter;
  }
  if (calls == Calls::kAnswerer) {
    Filter filter(SCMP_ACT_KILL_PROCESS);
    filter.add_all(SCMP_ACT_ALLOW, kAnswererCalls);
    filter.add(SCMP_ACT_ALLOW, "read", {is(0, STDIN_FILENO)});
    filter.add(SCMP_ACT_ALLOW, "write", {is(0, STDOUT_FILENO)});
    allow_data(filter);
    return filter;
  }
  Filter filter(SCMP_ACT_ERRNO(ENOSYS));
  filter.add_all(SCMP_ACT_KILL_PROCESS, kTakesOver);
  filter.add_all(SCMP_ACT_KILL_PROCESS, kTraces);
  allow_what_servers_do(filter);
  return filter;
}

}  // namespace

tl::expected<void, std::string> restrict_calls(Calls calls) {
  if (const int error = filter_of(calls).load(); error < 0)
    return tl::unexpected(fmt::format("seccomp: cannot put a filter in force: {}", std::strerror(-error)));
  return {};
}

const char* words(Calls calls) noexcept {
  switch (calls) {
    case Calls::kServer:
      return "UDP, threads and files to read are all that it may ask of the kernel";
    case Calls::kServerWithDriver:
      return "it starts no program and changes no other, but may ask the kernel for what a graphics driver may need";
    case Calls::kAnswerer:
      break;
  }
  return "it may read, write and end";
}

}  // namespace farfeel::transport
