/* Fails the n-th change of a folder: loaded before the C library, it counts what a command does to files there.
 *
 * ATTACK_FOLDER: changes of files under it count. ATTACK_FAIL: which one fails, from 1. ATTACK_HOW: once (that one, for
 * want of space), full (that one and all after it), short (half of a write, then as full), error (once, the device),
 * kill (the process ends there). ATTACK_COUNT: a file that takes the number of changes.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static _Atomic long changes = 0;

static int inside(const char *path) {
    const char *folder = getenv("ATTACK_FOLDER");
    return folder && path && strncmp(path, folder, strlen(folder)) == 0;
}

static int inside_at(int at, const char *path) {
    char where[PATH_MAX], whole[2 * PATH_MAX], link[64];
    if (!path) return 0;
    if (path[0] == '/') return inside(path);
    snprintf(link, sizeof link, at == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", at);
    ssize_t n = readlink(link, where, sizeof where - 1);
    if (n < 0) return 0;
    where[n] = 0;
    snprintf(whole, sizeof whole, "%s/%s", where, path);
    return inside(whole);
}

static int inside_of(int file) {
    char where[PATH_MAX], link[64];
    struct stat kind;
    if (fstat(file, &kind) != 0 || !S_ISREG(kind.st_mode)) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t n = readlink(link, where, sizeof where - 1);
    if (n < 0) return 0;
    where[n] = 0;
    return inside(where);
}

/* Whether this change fails: 0 no, 1 yes, 2 after half of it. A full disk takes what makes room. */
static int fails_if(int takes_room) {
    const char *at = getenv("ATTACK_FAIL"), *how = getenv("ATTACK_HOW"), *count = getenv("ATTACK_COUNT");
    long now = ++changes, wanted = at ? atol(at) : 0;
    if (count) {
        int (*open_)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
        ssize_t (*write_)(int, const void *, size_t) = dlsym(RTLD_NEXT, "write");
        int file = open_(count, O_WRONLY | O_CREAT | O_APPEND, 0600);
        if (file >= 0) {
            write_(file, ".", 1);
            close(file);
        }
    }
    if (!wanted || !how) return 0;
    if (now == wanted && strcmp(how, "kill") == 0) raise(SIGKILL);
    if (!takes_room && strcmp(how, "error") != 0) return 0;
    if (now == wanted && strcmp(how, "short") == 0) return 2;
    if (now == wanted || (now > wanted && (strcmp(how, "full") == 0 || strcmp(how, "short") == 0))) {
        errno = strcmp(how, "error") == 0 ? EIO : ENOSPC;
        return 1;
    }
    return 0;
}

static int fails(void) { return fails_if(1); }

#define NEXT(type, name, ...) type (*next)(__VA_ARGS__) = dlsym(RTLD_NEXT, name)

ssize_t write(int file, const void *data, size_t size) {
    NEXT(ssize_t, "write", int, const void *, size_t);
    if (!inside_of(file)) return next(file, data, size);
    int how = fails();
    return how == 1 ? -1 : next(file, data, how == 2 && size > 1 ? size / 2 : size);
}

ssize_t pwrite64(int file, const void *data, size_t size, off_t at) {
    NEXT(ssize_t, "pwrite64", int, const void *, size_t, off_t);
    if (!inside_of(file)) return next(file, data, size, at);
    int how = fails();
    return how == 1 ? -1 : next(file, data, how == 2 && size > 1 ? size / 2 : size, at);
}

ssize_t pwrite(int file, const void *data, size_t size, off_t at) { return pwrite64(file, data, size, at); }

ssize_t writev(int file, const struct iovec *some, int count) {
    NEXT(ssize_t, "writev", int, const struct iovec *, int);
    return inside_of(file) && fails() == 1 ? -1 : next(file, some, count);
}

int fsync(int file) {
    NEXT(int, "fsync", int);
    return inside_of(file) && fails() ? -1 : next(file);
}

int fdatasync(int file) {
    NEXT(int, "fdatasync", int);
    return inside_of(file) && fails() ? -1 : next(file);
}

int ftruncate64(int file, off_t size) {
    NEXT(int, "ftruncate64", int, off_t);
    return inside_of(file) && fails() ? -1 : next(file, size);
}

int ftruncate(int file, off_t size) { return ftruncate64(file, size); }

int rename(const char *from, const char *to) {
    NEXT(int, "rename", const char *, const char *);
    return inside_at(AT_FDCWD, to) && fails() ? -1 : next(from, to);
}

int renameat(int a, const char *from, int b, const char *to) {
    NEXT(int, "renameat", int, const char *, int, const char *);
    return inside_at(b, to) && fails() ? -1 : next(a, from, b, to);
}

int link(const char *from, const char *to) {
    NEXT(int, "link", const char *, const char *);
    return inside_at(AT_FDCWD, to) && fails() ? -1 : next(from, to);
}

int unlink(const char *path) {
    NEXT(int, "unlink", const char *);
    return inside_at(AT_FDCWD, path) && fails_if(0) ? -1 : next(path);
}

int unlinkat(int at, const char *path, int how) {
    NEXT(int, "unlinkat", int, const char *, int);
    return inside_at(at, path) && fails_if(0) ? -1 : next(at, path, how);
}

int rmdir(const char *path) {
    NEXT(int, "rmdir", const char *);
    return inside_at(AT_FDCWD, path) && fails_if(0) ? -1 : next(path);
}

int posix_fallocate64(int file, off_t at, off_t size) {
    NEXT(int, "posix_fallocate64", int, off_t, off_t);
    return inside_of(file) && fails() ? errno : next(file, at, size);
}

int posix_fallocate(int file, off_t at, off_t size) { return posix_fallocate64(file, at, size); }

int mkdir(const char *path, mode_t mode) {
    NEXT(int, "mkdir", const char *, mode_t);
    return inside_at(AT_FDCWD, path) && fails() ? -1 : next(path, mode);
}

/* A file that is made new is a change; one that is only read is none. */
static int opened(int at, const char *path, int how, mode_t mode) {
    NEXT(int, "openat64", int, const char *, int, ...);
    if ((how & O_CREAT) && inside_at(at, path) && fails() == 1) return -1;
    return next(at, path, how, mode);
}

#define MODE(how, last)                \
    mode_t mode = 0;                   \
    if ((how) & (O_CREAT | O_TMPFILE)) { \
        va_list more;                  \
        va_start(more, last);          \
        mode = va_arg(more, mode_t);   \
        va_end(more);                  \
    }
#include <stdarg.h>

int open(const char *path, int how, ...) { MODE(how, how) return opened(AT_FDCWD, path, how, mode); }
int open64(const char *path, int how, ...) { MODE(how, how) return opened(AT_FDCWD, path, how | O_LARGEFILE, mode); }
int openat(int at, const char *path, int how, ...) { MODE(how, how) return opened(at, path, how, mode); }
int openat64(int at, const char *path, int how, ...) { MODE(how, how) return opened(at, path, how | O_LARGEFILE, mode); }
