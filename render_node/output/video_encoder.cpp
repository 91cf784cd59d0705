#include "render_node/output/video_encoder.h"

#include <algorithm>
#include <array>
#include <limits>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

namespace fivepipe::render {
namespace {

// The quality of cv::VideoWriter: x264's default, and for MPEG-4 part 2 a high rate.
constexpr char kCrf[] = "23";
constexpr double kMpeg4BitsPerPixel = 2;
constexpr int kMpeg4MinQuantiser = 3, kMpeg4KeyFrameDistance = 12;
// MPEG-4 part 2 stores the denominator of its time base in 16 bits.
constexpr int kMaxTimeBase = 65535;

// A fragment ends before each key frame and after this time. delay_moov lets the header state by
// how much the codec's reordering delays the first frame. skip_trailer: without it the muxer keeps
// a table of all fragments, which readers do not need.
constexpr char kMovFlags[] = "frag_keyframe+delay_moov+default_base_moof+skip_trailer";
constexpr std::int64_t kFragment_us = 1'000'000;

std::string text_of(int av_error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(av_error, text.data(), text.size());
  return text.data();
}

void set_quality(AVCodecContext& codec, double frame_rate_hz) {
  if (codec.codec_id == AV_CODEC_ID_H264) {
    // Encoders other than libx264 have no such option and use their own quality.
    av_opt_set(codec.priv_data, "crf", kCrf, 0);
    return;
  }
  const double rate_bit_s = kMpeg4BitsPerPixel * frame_rate_hz * codec.width * codec.height;
  codec.bit_rate = std::int64_t(std::min(rate_bit_s, double(std::numeric_limits<int>::max())));
  codec.qmin = kMpeg4MinQuantiser;
  codec.gop_size = kMpeg4KeyFrameDistance;
}

AVFrame* allocated(AVPixelFormat format, cv::Size size_px) {
  AVFrame* frame = av_frame_alloc();
  if (frame == nullptr) return nullptr;
  frame->format = format;
  frame->width = size_px.width;
  frame->height = size_px.height;
  if (av_frame_get_buffer(frame, 0) < 0) av_frame_free(&frame);
  return frame;
}

}  // namespace

void VideoEncoder::Free::operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
void VideoEncoder::Free::operator()(AVFormatContext* muxer) const {
  avio_closep(&muxer->pb);
  avformat_free_context(muxer);
}
void VideoEncoder::Free::operator()(AVFrame* frame) const { av_frame_free(&frame); }
void VideoEncoder::Free::operator()(AVPacket* packet) const { av_packet_free(&packet); }
void VideoEncoder::Free::operator()(SwsContext* scaler) const { sws_freeContext(scaler); }

// Returns the result, unless it is an error of FFmpeg: then throws OutputError.
int VideoEncoder::check(int result, const char* what) const {
  if (result < 0) throw OutputError(file_.string() + ": " + what + ": " + text_of(result));
  return result;
}

VideoEncoder::VideoEncoder(const std::filesystem::path& file, cv::Size size_px,
                           double frame_rate_hz)
    : file_(file), size_px_(size_px) {
  av_log_set_level(AV_LOG_ERROR);  // of the whole process; OpenCV sets the same level
  if (const std::string problem = open_codec(frame_rate_hz); !problem.empty())
    throw OutputError(file_.string() +
                      ": FFmpeg cannot encode it as H.264 or MPEG-4 part 2: " + problem);
  to_yuv_.reset(sws_getContext(size_px.width, size_px.height, AV_PIX_FMT_BGR24, size_px.width,
                               size_px.height, AV_PIX_FMT_YUV420P, SWS_BICUBIC, nullptr, nullptr,
                               nullptr));
  bgr_.reset(allocated(AV_PIX_FMT_BGR24, size_px));
  yuv_.reset(allocated(AV_PIX_FMT_YUV420P, size_px));
  packet_.reset(av_packet_alloc());
  if (!to_yuv_ || !bgr_ || !yuv_ || !packet_) check(AVERROR(ENOMEM), "cannot encode it");
  open_file();
}

VideoEncoder::~VideoEncoder() = default;

// Returns why no codec could be opened, or an empty text.
std::string VideoEncoder::open_codec(double frame_rate_hz) {
  std::string problem = "it has neither encoder";
  for (const AVCodecID id : {AV_CODEC_ID_H264, AV_CODEC_ID_MPEG4}) {
    const AVCodec* encoder = avcodec_find_encoder(id);
    if (encoder == nullptr) continue;
    codec_.reset(avcodec_alloc_context3(encoder));
    if (!codec_) return text_of(AVERROR(ENOMEM));
    codec_->width = size_px_.width;
    codec_->height = size_px_.height;
    codec_->pix_fmt = AV_PIX_FMT_YUV420P;
    codec_->framerate = av_d2q(frame_rate_hz, kMaxTimeBase);
    codec_->time_base = av_inv_q(codec_->framerate);
    codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;  // MP4 stores the codec's header once
    set_quality(*codec_, frame_rate_hz);
    const int result = avcodec_open2(codec_.get(), encoder, nullptr);
    if (result >= 0) return {};
    problem = text_of(result);
  }
  return problem;
}

void VideoEncoder::open_file() {
  AVFormatContext* muxer = nullptr;
  check(avformat_alloc_output_context2(&muxer, nullptr, "mp4", nullptr), "cannot write MP4");
  muxer_.reset(muxer);
  AVStream* stream = avformat_new_stream(muxer, nullptr);
  if (stream == nullptr) check(AVERROR(ENOMEM), "cannot write MP4");
  check(avcodec_parameters_from_context(stream->codecpar, codec_.get()), "cannot write MP4");
  stream->time_base = codec_->time_base;
  stream->avg_frame_rate = codec_->framerate;
  // Hands each fragment to the kernel at once, so that it survives the process.
  muxer->flags |= AVFMT_FLAG_FLUSH_PACKETS;
  check(avio_open(&muxer->pb, ("file:" + file_.string()).c_str(), AVIO_FLAG_WRITE),
        "cannot create it");
  AVDictionary* options = nullptr;
  av_dict_set(&options, "movflags", kMovFlags, 0);
  av_dict_set_int(&options, "frag_duration", kFragment_us, 0);
  const int result = avformat_write_header(muxer, &options);
  av_dict_free(&options);
  check(result, "cannot write it");
}

void VideoEncoder::write(const cv::Mat& image_bgr) {
  // The SIMD code of swscale reads beyond the end of an image; FFmpeg's frames have room for that.
  av_image_copy_plane(bgr_->data[0], bgr_->linesize[0], image_bgr.data, int(image_bgr.step),
                      3 * size_px_.width, size_px_.height);
  check(av_frame_make_writable(yuv_.get()), "cannot encode it");  // the codec may use the last one
  sws_scale(to_yuv_.get(), bgr_->data, bgr_->linesize, 0, size_px_.height, yuv_->data,
            yuv_->linesize);
  yuv_->pts = frames_++;
  check(avcodec_send_frame(codec_.get(), yuv_.get()), "cannot encode it");
  write_packets();
}

// Writes what the codec has finished.
void VideoEncoder::write_packets() {
  AVStream& stream = *muxer_->streams[0];
  for (;;) {
    const int result = avcodec_receive_packet(codec_.get(), packet_.get());
    if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
    check(result, "cannot encode it");
    packet_->stream_index = 0;
    av_packet_rescale_ts(packet_.get(), codec_->time_base, stream.time_base);
    check(av_write_frame(muxer_.get(), packet_.get()), "cannot write it");
    av_packet_unref(packet_.get());
  }
}

void VideoEncoder::finish() {
  check(avcodec_send_frame(codec_.get(), nullptr), "cannot encode it");
  write_packets();
  check(av_write_trailer(muxer_.get()), "cannot write it");
  check(avio_closep(&muxer_->pb), "cannot write it");
}

}  // namespace fivepipe::render
