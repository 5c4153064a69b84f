/* What a test makes the stand-in for MindVision's library do, through its own exports. */
#ifndef CREPES_MINDVISION_STUB_H
#define CREPES_MINDVISION_STUB_H

#include <stdint.h>

/* All of it at once; a test owns the process, and nobody else sets or reads it meanwhile. */
struct mindvision_stub {
  int cameras;        /* plugged in; their serial numbers are MV1, MV2, ... */
  int enumerate_code; /* answers of these functions, 0 for success */
  int open_code;
  int exposure_code;
  int frame_code; /* of the next frames; -12: time-out */
  uint32_t media_type;
  int width, height;    /* of the frames */
  int short_by;         /* bytes that are missing of what a frame claims */
  uint32_t exposure_us; /* that frames claim */
  int waiting;          /* frames that can be fetched */
  /* what it saw */
  int open_handles, lent_buffers, releases_after_close, rate_hz, trigger_mode, auto_exposure;
  double set_exposure_us;
  uint32_t timestamp; /* of the next frame, 0.1 ms */
};

#endif
