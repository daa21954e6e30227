// For LD_PRELOAD of User-mode Linux: its 2,696 bytes for a process's extended registers (PTRACE_GETREGSET,
// NT_X86_XSTATE) hold AVX-512 and no more. A processor with more of them (AMX: about 11 KB) lets it read a
// part and refuses to write one: EFAULT, and the guest's first process ends the guest. Here a part that is
// written is completed by what the process has in the rest.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <linux/ptrace.h>
#include <string.h>
#include <sys/uio.h>

enum { kMaxRegisterBytes = 65536 };
typedef long (*Ptrace)(int, int, void*, void*);
long ptrace(int request, int process, void* address, void* data);

static long write_whole(Ptrace next, int process, void* kind, const struct iovec* part) {
  static _Alignas(
      64) char registers[kMaxRegisterBytes];  // User-mode Linux has one CPU and one thread that traces
  struct iovec whole = {registers, sizeof registers};
  if (next(PTRACE_GETREGSET, process, kind, &whole) < 0) return -1;
  if (whole.iov_len <= part->iov_len) {
    errno = EFAULT;
    return -1;
  }
  memcpy(registers, part->iov_base, part->iov_len);
  return next(PTRACE_SETREGSET, process, kind, &whole);
}

// Without glibc's declaration, whose number of arguments varies: all callers pass the four of the system
// call.
long ptrace(int request, int process, void* address, void* data) {
  static Ptrace next;
  if (next == NULL) *(void**)&next = dlsym(RTLD_NEXT, "ptrace");
  const long result = next(request, process, address, data);
  if (result < 0 && errno == EFAULT && request == PTRACE_SETREGSET && address == (void*)NT_X86_XSTATE) {
    return write_whole(next, process, address, data);
  }
  return result;
}
