#include "app/vision/dv/dv_codec.h"

#include <dlfcn.h>

#include <algorithm>
#include <string>

extern "C" {
#include <libavcodec/avcodec.h>
}

namespace plumbline::vision {

struct LibavcodecFunctions {
  decltype(&avcodec_find_decoder) find_decoder;
  decltype(&avcodec_alloc_context3) alloc_context;
  decltype(&avcodec_open2) open;
  decltype(&avcodec_send_packet) send_packet;
  decltype(&avcodec_receive_frame) receive_frame;
  decltype(&avcodec_free_context) free_context;
  decltype(&av_packet_alloc) packet_alloc;
  decltype(&av_packet_free) packet_free;
  decltype(&av_frame_alloc) frame_alloc;
  decltype(&av_frame_free) frame_free;
  decltype(&av_log_set_callback) set_log;
};

namespace {

int reported_errors = 0;

void CountErrors(void*, int level, const char*, va_list) {
  if (level <= AV_LOG_ERROR) ++reported_errors;
}

template <typename Function>
bool Find(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  return function != nullptr;
}

/// The functions of libavutil are found through libavcodec, which depends on it. The library stays
/// loaded.
bool FindFunctions(LibavcodecFunctions& f) {
  const std::string name = "libavcodec.so." + std::to_string(LIBAVCODEC_VERSION_MAJOR);
  void* const library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
  return library != nullptr && Find(library, "avcodec_find_decoder", f.find_decoder) &&
         Find(library, "avcodec_alloc_context3", f.alloc_context) &&
         Find(library, "avcodec_open2", f.open) &&
         Find(library, "avcodec_send_packet", f.send_packet) &&
         Find(library, "avcodec_receive_frame", f.receive_frame) &&
         Find(library, "avcodec_free_context", f.free_context) &&
         Find(library, "av_packet_alloc", f.packet_alloc) &&
         Find(library, "av_packet_free", f.packet_free) &&
         Find(library, "av_frame_alloc", f.frame_alloc) &&
         Find(library, "av_frame_free", f.frame_free) &&
         Find(library, "av_log_set_callback", f.set_log);
}

/// Chroma subsampling: binary logarithms of the number of pixels per sample.
struct Chroma {
  int columns, rows;
};

/// Row of the frame that holds the chroma of row `r` of the lower field. In 4:2:0 the chroma rows
/// alternate between the fields, too: one for two rows of the same field. [IEC 61834-2, 8.1]
int ChromaRow(const Chroma& chroma, int r) {
  return 2 * (r >> chroma.rows) + 1;
}

void PackLowerField(const AVFrame& picture, const Chroma& chroma, int rows,
                    std::vector<std::uint8_t>& yuyv) {
  const auto row_of = [&](int plane, int row) {
    return picture.data[plane] + static_cast<std::ptrdiff_t>(row) * picture.linesize[plane];
  };
  yuyv.resize(std::size_t{2} * camera::kDvWidth_px * static_cast<std::size_t>(rows));
  std::uint8_t* to = yuyv.data();
  for (int r = 0; r < rows; ++r) {
    const std::uint8_t* const y = row_of(0, 2 * r + 1);
    const std::uint8_t* const u = row_of(1, ChromaRow(chroma, r));
    const std::uint8_t* const v = row_of(2, ChromaRow(chroma, r));
    for (int x = 0; x < camera::kDvWidth_px; x += 2) {
      *to++ = y[x];
      *to++ = u[x >> chroma.columns];
      *to++ = y[x + 1];
      *to++ = v[x >> chroma.columns];
    }
  }
}

}  // namespace

std::unique_ptr<DvCodec> DvCodec::Load() {
  std::unique_ptr<DvCodec> codec(new DvCodec);
  auto functions = std::make_unique<LibavcodecFunctions>();
  if (!FindFunctions(*functions)) return nullptr;
  functions->set_log(CountErrors);
  codec->functions_ = std::move(functions);
  const LibavcodecFunctions& f = *codec->functions_;
  const AVCodec* const decoder = f.find_decoder(AV_CODEC_ID_DVVIDEO);
  codec->context_ = decoder == nullptr ? nullptr : f.alloc_context(decoder);
  codec->picture_ = f.frame_alloc();
  codec->packet_ = f.packet_alloc();
  if (codec->context_ == nullptr || codec->picture_ == nullptr || codec->packet_ == nullptr) {
    return nullptr;
  }
  codec->context_->thread_count = 1;
  return f.open(codec->context_, decoder, nullptr) == 0 ? std::move(codec) : nullptr;
}

DvCodec::~DvCodec() {
  if (!functions_) return;
  functions_->packet_free(&packet_);
  functions_->frame_free(&picture_);
  functions_->free_context(&context_);
}

bool DvCodec::DecodeLowerField(std::span<const std::uint8_t> frame, const camera::DifFormat& format,
                               std::vector<std::uint8_t>& yuyv) {
  // A packet without a reference count is copied, with the padding that the decoder requires.
  packet_->data = const_cast<std::uint8_t*>(frame.data());
  packet_->size = static_cast<int>(frame.size());
  reported_errors = 0;
  const bool decoded = functions_->send_packet(context_, packet_) == 0 &&
                       functions_->receive_frame(context_, picture_) == 0 && reported_errors == 0;
  const int rows = camera::FieldRows(format);
  if (!decoded || picture_->width != camera::kDvWidth_px || picture_->height != 2 * rows) {
    return false;
  }
  switch (picture_->format) {
    case AV_PIX_FMT_YUV420P:  // 625 lines
      PackLowerField(*picture_, {1, 1}, rows, yuyv);
      return true;
    case AV_PIX_FMT_YUV411P:  // 525 lines, and 625 lines of SMPTE 314M
      PackLowerField(*picture_, {2, 0}, rows, yuyv);
      return true;
    default:
      return false;
  }
}

}  // namespace plumbline::vision
