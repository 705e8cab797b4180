// A USB zoom camera as the kernel's own drivers see it: UVC (grey 640 x 480, bulk, zoom control
// with its interrupt) and, on a HID interface, the bridge of a motorised lens (CP2112, as
// config/profiles/ zoom/computar-lensconnect.toml asks it). Played through raw_gadget on dummy_hcd.
//   usb_camera IMAGE.grey     standard input: "zoom N"; its end unplugs the camera
// [USB Device Class Definition for Video Devices 1.1; HID 1.11; Silicon Labs AN495]
#include <errno.h>
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/raw_gadget.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { kWidth = 640, kHeight = 480, kBytes = kWidth * kHeight, kPayload = 16384 };
enum { kVideoIn = 0x81, kStatusIn = 0x83, kHidIn = 0x85 };
enum { kControl = 0, kStreaming = 1, kHid = 2 };  // interfaces
enum { kZoomSelector = 0x0b, kZoomMax = 16384, kZoomRegister = 0x1000 };
static const uint32_t kInterval = 5000000;  // 100 ns: 2 images a second

#define U16(x) (uint8_t)(x), (uint8_t)((x) >> 8)
#define U32(x) U16(x), U16((x) >> 16)

static const uint8_t device[] = {18,          1,           U16(0x200), 0xef, 2, 1, 64,
                                 U16(0x10c4), U16(0x8d08), U16(0x100), 1,    2, 3, 1};
static const uint8_t report[] = {  // vendor page; 0x11 and 0x12 to the bridge, 0x13 from it
    0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01, 0x15, 0x00, 0x26, 0xff, 0x00, 0x75,
    0x08, 0x85, 0x11, 0x95, 0x06, 0x09, 0x02, 0x91, 0x02, 0x85, 0x12, 0x95, 0x02,
    0x09, 0x03, 0x91, 0x02, 0x85, 0x13, 0x95, 0x04, 0x09, 0x04, 0x81, 0x02, 0xc0};
static uint8_t configuration[] = {9,
                                  2,
                                  U16(0),
                                  3,
                                  1,
                                  0,
                                  0x80,
                                  50,
                                  8,
                                  11,
                                  kControl,
                                  2,
                                  14,
                                  3,
                                  0,
                                  0,  // the two of video belong together
                                  9,
                                  4,
                                  kControl,
                                  0,
                                  1,
                                  14,
                                  1,
                                  0,
                                  0,
                                  13,
                                  0x24,
                                  1,
                                  U16(0x110),
                                  U16(13 + 18 + 9),
                                  U32(48000000),
                                  1,
                                  kStreaming,
                                  18,
                                  0x24,
                                  2,
                                  1,
                                  U16(0x201),
                                  0,
                                  0,
                                  U16(0),
                                  U16(0),
                                  U16(0),
                                  3,
                                  0x00,
                                  0x02,
                                  0x00,  // a camera that zooms
                                  9,
                                  0x24,
                                  3,
                                  2,
                                  U16(0x101),
                                  0,
                                  1,
                                  0,
                                  7,
                                  5,
                                  kStatusIn,
                                  3,
                                  U16(16),
                                  8,
                                  5,
                                  0x25,
                                  3,
                                  U16(16),
                                  9,
                                  4,
                                  kStreaming,
                                  0,
                                  1,
                                  14,
                                  2,
                                  0,
                                  0,
                                  14,
                                  0x24,
                                  1,
                                  1,
                                  U16(14 + 27 + 30),
                                  kVideoIn,
                                  0,
                                  2,
                                  0,
                                  0,
                                  0,
                                  1,
                                  0,
                                  27,
                                  0x24,
                                  4,
                                  1,
                                  1,
                                  'Y',
                                  '8',
                                  '0',
                                  '0',
                                  0,
                                  0,
                                  0x10,
                                  0,
                                  0x80,
                                  0,
                                  0,
                                  0xaa,
                                  0,
                                  0x38,
                                  0x9b,
                                  0x71,
                                  8,
                                  1,
                                  0,
                                  0,
                                  0,
                                  0,
                                  30,
                                  0x24,
                                  5,
                                  1,
                                  0,
                                  U16(kWidth),
                                  U16(kHeight),
                                  U32(kBytes * 16),
                                  U32(kBytes * 16),
                                  U32(kBytes),
                                  U32(5000000),
                                  1,
                                  U32(5000000),
                                  7,
                                  5,
                                  kVideoIn,
                                  2,
                                  U16(512),
                                  0,
                                  9,
                                  4,
                                  kHid,
                                  0,
                                  1,
                                  3,
                                  0,
                                  0,
                                  0,
                                  9,
                                  0x21,
                                  U16(0x111),
                                  0,
                                  1,
                                  0x22,
                                  U16(sizeof report),
                                  7,
                                  5,
                                  kHidIn,
                                  3,
                                  U16(8),
                                  4};

struct Transfer {
  struct usb_raw_ep_io head;
  uint8_t data[kPayload];
};

static int fd, video, status, hid;
static uint8_t image[kBytes];
static volatile int streaming, zoom = 4000, told = 4000, asked_register;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t answers = PTHREAD_COND_INITIALIZER;
static int answers_due;

static int Write(int endpoint, const void* data, unsigned size) {
  static __thread struct Transfer transfer;
  transfer.head.ep = (uint16_t)endpoint;
  transfer.head.length = size;
  memcpy(transfer.data, data, size);
  return ioctl(fd, USB_RAW_IOCTL_EP_WRITE, &transfer);
}

static void* SendImages(void* unused) {
  static uint8_t payload[kPayload] = {2};
  for (int frame = 0;; ++frame) {
    while (!streaming) usleep(5000);
    for (int at = 0; at < kBytes && streaming;) {
      const int size = at + kPayload - 2 < kBytes ? kPayload - 2 : kBytes - at;
      payload[1] = (uint8_t)(0x80 | (frame & 1) | (at + size == kBytes ? 2 : 0));
      memcpy(payload + 2, image + at, (size_t)size);
      if (Write(video, payload, (unsigned)size + 2) < 0) {
        if (errno == ESHUTDOWN) streaming = 0;
        usleep(2000);
        continue;
      }
      at += size;
    }
    usleep(kInterval / 10);
  }
  return unused;
}

/// A zoom that somebody turned is told as the class says: control, value change, camera terminal.
static void* TellZoom(void* unused) {
  for (;; usleep(3000)) {
    const int now = zoom;
    if (now == told) continue;
    const uint8_t change[7] = {1, 1, 0, kZoomSelector, 0, U16(now)};
    if (Write(status, change, sizeof change) >= 0) told = now;
  }
  return unused;
}

static void* AnswerHid(void* unused) {
  for (;;) {
    pthread_mutex_lock(&mutex);
    while (answers_due == 0) pthread_cond_wait(&answers, &mutex);
    --answers_due;
    const int value = asked_register == kZoomRegister ? zoom : 0;
    pthread_mutex_unlock(&mutex);
    const uint8_t answer[5] = {0x13, 2, 2, (uint8_t)(value >> 8), (uint8_t)value};
    Write(hid, answer, sizeof answer);
  }
  return unused;
}

static void* Obey(void* unused) {
  char line[64];
  while (fgets(line, sizeof line, stdin) != NULL) {
    int value;
    if (sscanf(line, "zoom %d", &value) == 1) zoom = value;
  }
  _exit(0);
  return unused;
}

static int Enable(int address, int type, int size, int interval) {
  struct usb_endpoint_descriptor d = {
      7, 5, (uint8_t)address, (uint8_t)type, (uint16_t)size, (uint8_t)interval, 0, 0};
  return ioctl(fd, USB_RAW_IOCTL_EP_ENABLE, &d);
}

static void Configured(void) {
  static int before;
  if (before) return;
  before = 1;
  video = Enable(kVideoIn, 2, 512, 0);
  status = Enable(kStatusIn, 3, 16, 8);
  hid = Enable(kHidIn, 3, 8, 4);
  ioctl(fd, USB_RAW_IOCTL_VBUS_DRAW, 50);
  ioctl(fd, USB_RAW_IOCTL_CONFIGURE, 0);
  void* (*const work[])(void*) = {SendImages, TellZoom, AnswerHid};
  for (int k = 0; k < 3; ++k) {
    pthread_t thread;
    pthread_create(&thread, NULL, work[k], NULL);
  }
}

static int Descriptor(int kind, int index, uint8_t* out) {
  static const char* const words[] = {"", "Rig", "Rig zoom camera", "RIG0001"};
  const void* from = kind == 1      ? device
                     : kind == 2    ? configuration
                     : kind == 0x22 ? (const void*)report
                                    : NULL;
  const int size = kind == 1 ? sizeof device : kind == 2 ? sizeof configuration : sizeof report;
  if (from != NULL) return memcpy(out, from, (size_t)size), size;
  if (kind != 3 || index > 3) return -1;
  if (index == 0) return memcpy(out, "\x04\x03\x09\x04", 4), 4;
  const int letters = (int)strlen(words[index]);
  memset(out, 0, (size_t)(2 + 2 * letters));
  out[0] = (uint8_t)(2 + 2 * letters);
  out[1] = 3;
  for (int k = 0; k < letters; ++k) out[2 + 2 * k] = (uint8_t)words[index][k];
  return 2 + 2 * letters;
}

static int Zoom(int request, uint8_t* out) {
  const int value = request == 0x81   ? zoom
                    : request == 0x83 ? kZoomMax
                    : request == 0x84 ? 1
                    : request == 0x87 ? 4000
                                      : 0;
  if (request == 0x86) return out[0] = 0x0b, 1;  // get, set, tells by itself
  const uint8_t bytes[2] = {U16(request == 0x85 ? 2 : value)};
  return memcpy(out, bytes, 2), request == 0x85 ? 2 : 2;
}

static int Probe(int request, uint8_t* out) {
  const uint8_t probe[34] = {
      0,      0,      1,      1,           U32(kInterval), U16(0),        U16(0),
      U16(0), U16(0), U16(0), U32(kBytes), U32(kPayload),  U32(48000000), 0,
      0,      0,      0};
  if (request == 0x86) return out[0] = 3, 1;
  if (request == 0x85) return out[0] = sizeof probe, out[1] = 0, 2;
  return memcpy(out, probe, sizeof probe), (int)sizeof probe;
}

/// What the host is answered. @return bytes, -1: refused
static int Answer(const struct usb_ctrlrequest* r, uint8_t* out) {
  const int selector = r->wValue >> 8, interface = r->wIndex & 255, entity = r->wIndex >> 8;
  if ((r->bRequestType & USB_TYPE_MASK) == USB_TYPE_STANDARD) {
    if (r->bRequest == USB_REQ_GET_DESCRIPTOR) return Descriptor(selector, r->wValue & 255, out);
    return out[0] = 0,
           r->bRequest == USB_REQ_GET_INTERFACE || r->bRequest == USB_REQ_GET_STATUS ? 1 : -1;
  }
  if (interface == kControl && entity == 1 && selector == kZoomSelector)
    return Zoom(r->bRequest, out);
  if (interface == kControl && entity == 0 && selector == 2) return out[0] = 0, 1;  // no error
  if (interface == kStreaming && (selector == 1 || selector == 2)) return Probe(r->bRequest, out);
  return -1;
}

/// What the host told. @return 0: refused
static int Take(const struct usb_ctrlrequest* r, const uint8_t* data, int size) {
  const int selector = r->wValue >> 8, interface = r->wIndex & 255;
  if ((r->bRequestType & USB_TYPE_MASK) == USB_TYPE_STANDARD) {
    if (r->bRequest == USB_REQ_SET_CONFIGURATION) Configured();
    if (r->bRequest == USB_REQ_SET_INTERFACE || r->bRequest == USB_REQ_CLEAR_FEATURE) streaming = 0;
    return r->bRequest == USB_REQ_SET_CONFIGURATION || r->bRequest == USB_REQ_SET_INTERFACE ||
           r->bRequest == USB_REQ_CLEAR_FEATURE;
  }
  if (interface == kControl && selector == kZoomSelector && size >= 2)
    return zoom = data[0] | data[1] << 8, 1;
  if (interface == kStreaming) return streaming = streaming || selector == 2, 1;
  if (interface != kHid) return 0;
  if (r->bRequest == 0x09 && size >= 1) {  // SET_REPORT
    pthread_mutex_lock(&mutex);
    if (data[0] == 0x11 && size >= 7) asked_register = data[5] << 8 | data[6];
    if (data[0] == 0x12) ++answers_due, pthread_cond_signal(&answers);
    pthread_mutex_unlock(&mutex);
  }
  return 1;
}

int main(int count, char** words) {
  FILE* file = count == 2 ? fopen(words[1], "rb") : NULL;
  if (file == NULL || fread(image, 1, kBytes, file) != kBytes)
    return fprintf(stderr, "usb_camera IMAGE.grey\n"), 2;
  configuration[2] = sizeof configuration & 255;
  configuration[3] = sizeof configuration >> 8;
  fd = open("/dev/raw-gadget", O_RDWR);
  struct usb_raw_init init = {
      .driver_name = "dummy_udc", .device_name = "dummy_udc.0", .speed = USB_SPEED_HIGH};
  if (fd < 0 || ioctl(fd, USB_RAW_IOCTL_INIT, &init) != 0 || ioctl(fd, USB_RAW_IOCTL_RUN, 0) != 0)
    return perror("raw-gadget"), 1;
  pthread_t thread;
  pthread_create(&thread, NULL, Obey, NULL);
  for (;;) {
    struct {
      struct usb_raw_event head;
      struct usb_ctrlrequest request;
    } event = {{0, sizeof event.request}, {0}};
    if (ioctl(fd, USB_RAW_IOCTL_EVENT_FETCH, &event) != 0) return perror("event"), 1;
    if (event.head.type != USB_RAW_EVENT_CONTROL) continue;
    struct {
      struct usb_raw_ep_io head;
      uint8_t data[512];
    } io = {{0}, {0}};
    const struct usb_ctrlrequest* r = &event.request;
    const unsigned length = r->wLength < sizeof io.data ? r->wLength : sizeof io.data;
    int good;
    if (r->bRequestType & USB_DIR_IN) {
      const int size = Answer(r, io.data);
      io.head.length = size < (int)length ? (unsigned)(size < 0 ? 0 : size) : length;
      good = size >= 0;
      if (good) ioctl(fd, USB_RAW_IOCTL_EP0_WRITE, &io);
    } else if (length == 0) {
      good = Take(r, io.data, 0);
      if (good) ioctl(fd, USB_RAW_IOCTL_EP0_READ, &io);
    } else {
      io.head.length = length;
      const int size = ioctl(fd, USB_RAW_IOCTL_EP0_READ, &io);
      good = 1;
      Take(r, io.data, size);
    }
    if (!good) ioctl(fd, USB_RAW_IOCTL_EP0_STALL, 0);
  }
}
