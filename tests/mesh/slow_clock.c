/* Preloaded into a program, makes its monotonic clock slower by the factor in SLOWER, and its waits as much longer:
 * for a robot whose processor is slower than the world that it simulates. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static double slower(void) {
  static double factor = 0;
  if (factor == 0) factor = getenv("SLOWER") ? atof(getenv("SLOWER")) : 1;
  return factor;
}

static struct timespec scaled(struct timespec t, double factor) {
  const double ns = ((double)t.tv_sec * 1e9 + (double)t.tv_nsec) * factor;
  const long long whole = (long long)ns;
  return (struct timespec){.tv_sec = whole / 1000000000, .tv_nsec = whole % 1000000000};
}

int clock_gettime(clockid_t clock, struct timespec *time) {
  const int result = (int)syscall(SYS_clock_gettime, clock, time);
  if (result == 0 && clock == CLOCK_MONOTONIC) *time = scaled(*time, 1 / slower());
  return result;
}

int nanosleep(const struct timespec *time, struct timespec *rest) {
  const struct timespec longer = scaled(*time, slower());
  return (int)syscall(SYS_nanosleep, &longer, rest);
}

int poll(struct pollfd *watched, nfds_t count, int timeout_ms) {
  const int longer = timeout_ms > 0 ? (int)(timeout_ms * slower()) : timeout_ms;
  return (int)syscall(SYS_poll, watched, count, longer);
}

int sigtimedwait(const sigset_t *signals, siginfo_t *info, const struct timespec *time) {
  const struct timespec longer = time ? scaled(*time, slower()) : (struct timespec){0};
  return (int)syscall(SYS_rt_sigtimedwait, signals, info, time ? &longer : NULL, _NSIG / 8);
}

int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock,
                           const struct timespec *end) {
  static int (*real)(pthread_cond_t *, pthread_mutex_t *, clockid_t, const struct timespec *);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "pthread_cond_clockwait");
  const struct timespec later = clock == CLOCK_MONOTONIC ? scaled(*end, slower()) : *end;
  return real(condition, mutex, clock, &later);
}
