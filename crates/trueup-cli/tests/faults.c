/* Makes one call of a program fail: loaded into it by tests/faults.rs, before all else.
 *
 * TRUEUP_FAULT_KIND says which calls are counted: "files", those that make, write, keep and rename regular files; "kill", the same,
 * but the program is killed instead; "memory", those for a megabyte of memory or more; "threads", those that start one. TRUEUP_FAULT is
 * the number of the one that fails, from 1 on; TRUEUP_FAULT_COUNT names a file that gets a letter for each.
 *
 * The kernel hands calls for files back (seccomp, SIGSYS), and they are made here: some libraries do not ask the C library. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#define LARGE (1 << 20)

static atomic_long calls;
static long wanted;
static int counted = -1, is_memory, is_threads, is_kill;

/* A call that the filter lets through, known by where it is made. */
__asm__(".text\n"
        "passed:\n"
        "  mov %rdi, %rax\n  mov %rsi, %rdi\n  mov %rdx, %rsi\n  mov %rcx, %rdx\n  mov %r8, %r10\n  mov %r9, %r8\n"
        "  mov 8(%rsp), %r9\n"
        "  syscall\n"
        "passed_end:\n"
        "  ret\n");
long passed(long number, long a, long b, long c, long d, long e, long f);
extern char passed_end[];

static int is_file(long descriptor) {
    struct stat status;
    return fstat((int)descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

static int makes(long flags) {
    return (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
}

/* Counts a call by its letter; whether it is to fail. */
static int is_wanted(char what) {
    if (counted >= 0) passed(SYS_write, counted, (long)&what, 1, 0, 0, 0);
    return atomic_fetch_add(&calls, 1) + 1 == wanted;
}

/* The letter of a call that is counted, and how it fails; 0 of others. */
static char letter(long number, const long *arguments, int *reason) {
    *reason = ENOSPC;
    switch (number) {
    case SYS_write:
    case SYS_writev:
    case SYS_pwrite64:
    case SYS_pwritev:
    case SYS_sendfile: return is_file(arguments[0]) ? 'w' : 0;
    case SYS_copy_file_range: return is_file(arguments[2]) ? 'w' : 0;
    case SYS_open: return makes(arguments[1]) ? 'o' : 0;
    case SYS_openat: return makes(arguments[2]) ? 'o' : 0;
    case SYS_mkdir:
    case SYS_mkdirat: return 'm';
    case SYS_ftruncate:
    case SYS_fallocate: return 't';
    case SYS_fsync:
    case SYS_fdatasync: *reason = EIO; return 's';
    case SYS_rename:
    case SYS_renameat:
    case SYS_renameat2:
    case SYS_link:
    case SYS_linkat: *reason = EIO; return 'r';
    }
    return 0;
}

static void handed_back(int signal, siginfo_t *info, void *context) {
    (void)signal;
    greg_t *registers = ((ucontext_t *)context)->uc_mcontext.gregs;
    const int order[6] = {REG_RDI, REG_RSI, REG_RDX, REG_R10, REG_R8, REG_R9};
    long arguments[6];
    for (int at = 0; at < 6; at++) arguments[at] = registers[order[at]];
    int reason, before = errno;
    char what = letter(info->si_syscall, arguments, &reason);
    if (what && is_wanted(what)) {
        if (is_kill) passed(SYS_kill, getpid(), SIGKILL, 0, 0, 0, 0);
        registers[REG_RAX] = -reason;
    } else {
        registers[REG_RAX] = passed(info->si_syscall, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4],
                                    arguments[5]);
    }
    errno = before;
}

static const int FILES[] = {SYS_write,  SYS_writev, SYS_pwrite64,  SYS_pwritev,   SYS_sendfile, SYS_copy_file_range,
                            SYS_open,   SYS_openat, SYS_mkdir,     SYS_mkdirat,   SYS_ftruncate, SYS_fallocate,
                            SYS_fsync,  SYS_fdatasync, SYS_rename, SYS_renameat,  SYS_renameat2, SYS_link, SYS_linkat};

/* Allocations are asked of the C library: the kernel could be asked in another way when it refuses. */
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);

static int is_refused(size_t bytes) {
    return is_memory && bytes >= LARGE && is_wanted('a') && (errno = ENOMEM);
}

void *malloc(size_t bytes) {
    return is_refused(bytes) ? NULL : __libc_malloc(bytes);
}

void *calloc(size_t count, size_t bytes) {
    return is_refused(count * bytes) ? NULL : __libc_calloc(count, bytes);
}

void *realloc(void *old, size_t bytes) {
    return is_refused(bytes) ? NULL : __libc_realloc(old, bytes);
}

int posix_memalign(void **place, size_t alignment, size_t bytes) {
    if (is_refused(bytes)) return ENOMEM;
    *place = __libc_memalign(alignment, bytes);
    return *place ? 0 : ENOMEM;
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*work)(void *), void *argument) {
    int (*next)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *) = dlsym(RTLD_NEXT, "pthread_create");
    if (is_threads && is_wanted('t')) return EAGAIN;
    return next(thread, attributes, work, argument);
}

__attribute__((constructor)) static void begin(void) {
    const char *kind = getenv("TRUEUP_FAULT_KIND"), *number = getenv("TRUEUP_FAULT"), *count = getenv("TRUEUP_FAULT_COUNT");
    if (!kind) return;
    wanted = number ? atol(number) : 0;
    if (count) counted = open(count, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
    is_memory = !strcmp(kind, "memory");
    is_threads = !strcmp(kind, "threads");
    is_kill = !strcmp(kind, "kill");
    if (is_memory || is_threads) return;
    const int many = sizeof FILES / sizeof *FILES;
    struct sigaction action = {.sa_sigaction = handed_back, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART};
    uint64_t place = (uint64_t)passed_end;
    struct sock_filter filter[64] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)place, 0, 3),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer) + 4),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)(place >> 32), 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
    };
    int length = 6;
    for (int at = 0; at < many; at++) {
        filter[length++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)FILES[at], 0, 1);
        filter[length++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
    }
    filter[length++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    struct sock_fprog program = {.len = (unsigned short)length, .filter = filter};
    /* A program that cannot be watched must not pass for one that bears it. */
    if (sigaction(SIGSYS, &action, NULL) || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
        || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program)) {
        _exit(99);
    }
}
