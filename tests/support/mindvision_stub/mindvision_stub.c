/* A stand-in for libMVSDK.so with its binary interface, for tests. */
#include "tests/support/mindvision_stub/mindvision_stub.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kMono8 = 0x01080001, kTimeOut = -12, kBadParameter = -6, kNotInitialized = -5 };

struct device_info {
  char text[8][32];
  uint32_t instance;
};

struct frame_head {
  uint32_t media_type, bytes;
  int32_t width, height, zoom_width, zoom_height;
  uint32_t is_trigger, timestamp, exposure_us;
  float gain;
  uint32_t processing[6];
};

struct mindvision_stub mindvision_stub = {
    .cameras = 1, .media_type = kMono8, .width = 64, .height = 48, .auto_exposure = 1};
static int initialized;

int CameraSdkInit(int language) {
  initialized = language == 0 || language == 1;
  return initialized ? 0 : kBadParameter;
}

int CameraEnumerateDevice(struct device_info* devices, int* count) {
  if (!initialized) return kNotInitialized;
  if (mindvision_stub.enumerate_code != 0) return mindvision_stub.enumerate_code;
  if (*count > mindvision_stub.cameras) *count = mindvision_stub.cameras;
  for (int i = 0; i < *count; ++i) {
    memset(&devices[i], 0, sizeof devices[i]);
    strcpy(devices[i].text[1], "MV-SUA133GM");
    snprintf(devices[i].text[7], 32, "MV%d", i + 1);
  }
  return 0;
}

int CameraInit(struct device_info* device, int mode, int team, int* handle) {
  if (mindvision_stub.open_code != 0) return mindvision_stub.open_code;
  if (mode != -1 || team != -1) return kBadParameter;
  *handle = 40 + atoi(device->text[7] + 2);
  ++mindvision_stub.open_handles;
  return 0;
}

static int known(int handle) { return mindvision_stub.open_handles > 0 && handle > 40; }

int CameraPlay(int handle) { return known(handle) ? 0 : kBadParameter; }

int CameraGetImageBuffer(int handle, struct frame_head* head, uint8_t** pixels,
                         uint32_t timeout_ms) {
  (void)timeout_ms;
  if (!known(handle)) return kBadParameter;
  if (mindvision_stub.frame_code != 0) return mindvision_stub.frame_code;
  if (mindvision_stub.waiting == 0) return kTimeOut;
  --mindvision_stub.waiting;
  const size_t size = (size_t)mindvision_stub.width * (size_t)mindvision_stub.height;
  memset(head, 0, sizeof *head);
  head->media_type = mindvision_stub.media_type;
  head->bytes = (uint32_t)(size - (size_t)mindvision_stub.short_by);
  head->width = mindvision_stub.width;
  head->height = mindvision_stub.height;
  head->timestamp = mindvision_stub.timestamp;
  head->exposure_us = mindvision_stub.exposure_us;
  *pixels = malloc(size);
  memset(*pixels, (int)(mindvision_stub.timestamp & 0xff), size);
  ++mindvision_stub.lent_buffers;
  mindvision_stub.timestamp += 50; /* 5 ms */
  return 0;
}

int CameraReleaseImageBuffer(int handle, uint8_t* pixels) {
  if (!known(handle)) ++mindvision_stub.releases_after_close;
  free(pixels);
  --mindvision_stub.lent_buffers;
  return 0;
}

int CameraUnInit(int handle) {
  if (!known(handle)) return kBadParameter;
  --mindvision_stub.open_handles;
  return 0;
}

int CameraSetAeState(int handle, int on) {
  if (!known(handle)) return kBadParameter;
  mindvision_stub.auto_exposure = on;
  return 0;
}

int CameraSetExposureTime(int handle, double exposure_us) {
  if (!known(handle)) return kBadParameter;
  mindvision_stub.set_exposure_us = exposure_us;
  return mindvision_stub.exposure_code;
}

int CameraSetFrameRate(int handle, int rate_hz) {
  if (!known(handle)) return kBadParameter;
  mindvision_stub.rate_hz = rate_hz;
  return 0;
}

int CameraSetTriggerMode(int handle, int mode) {
  if (!known(handle)) return kBadParameter;
  mindvision_stub.trigger_mode = mode;
  return 0;
}
