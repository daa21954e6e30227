// For LD_PRELOAD of User-mode Linux: makes this machine's processor look as if its extended registers took
// 11,008 bytes (those of one with AMX): a part of them can be read and only the whole be written. What
// whole_registers.c is tried against.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <linux/ptrace.h>
#include <string.h>
#include <sys/uio.h>

enum { kWideBytes = 11008 };
typedef long (*Ptrace)(int, int, void*, void*);
long ptrace(int request, int process, void* address, void* data);

static long read_wide(Ptrace next, int process, struct iovec* asked) {
  const size_t wanted = asked->iov_len < kWideBytes ? asked->iov_len : kWideBytes;
  const long result = next(PTRACE_GETREGSET, process, (void*)NT_X86_XSTATE, asked);
  if (result == 0 && asked->iov_len < wanted) {
    memset((char*)asked->iov_base + asked->iov_len, 0, wanted - asked->iov_len);
    asked->iov_len = wanted;
  }
  return result;
}

static long write_wide(Ptrace next, int process, const struct iovec* given) {
  if (given->iov_len < kWideBytes) {
    errno = EFAULT;
    return -1;
  }
  static char scratch[kWideBytes];
  struct iovec real = {scratch, sizeof scratch};
  if (next(PTRACE_GETREGSET, process, (void*)NT_X86_XSTATE, &real) < 0) return -1;
  real.iov_base = given->iov_base;
  return next(PTRACE_SETREGSET, process, (void*)NT_X86_XSTATE, &real);
}

// Without glibc's declaration, whose number of arguments varies: all callers pass the four of the system
// call.
long ptrace(int request, int process, void* address, void* data) {
  static Ptrace next;
  if (next == NULL) *(void**)&next = dlsym(RTLD_NEXT, "ptrace");
  if (address == (void*)NT_X86_XSTATE && request == PTRACE_GETREGSET) return read_wide(next, process, data);
  if (address == (void*)NT_X86_XSTATE && request == PTRACE_SETREGSET) return write_wide(next, process, data);
  return next(request, process, address, data);
}
