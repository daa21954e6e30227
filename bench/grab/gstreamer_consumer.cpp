#ifdef TUBED_BENCH_GSTREAMER
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include <atomic>
#include <stdexcept>

#include "bench/grab/consumers.hpp"

namespace tubed {

namespace {

struct Sink {
  const OnPicture* on_picture = nullptr;
  std::atomic<bool> is_enough = false;
};

GstFlowReturn take(GstAppSink* app, gpointer user) {
  auto& sink = *static_cast<Sink*>(user);
  GstSample* const sample = gst_app_sink_pull_sample(app);
  if (sample == nullptr) return GST_FLOW_EOS;
  GstMapInfo map{};
  GstBuffer* const buffer = gst_sample_get_buffer(sample);
  if (buffer != nullptr && gst_buffer_map(buffer, &map, GST_MAP_READ) != FALSE) {
    if (!sink.is_enough && !(*sink.on_picture)(map.data, map.size)) sink.is_enough = true;
    gst_buffer_unmap(buffer, &map);
  }
  gst_sample_unref(sample);
  return sink.is_enough ? GST_FLOW_EOS : GST_FLOW_OK;
}

std::string pipeline_of(const CardFormat& format) {
  const std::string size = ",width=" + std::to_string(format.width) +
                           ",height=" + std::to_string(format.height) +
                           ",framerate=" + std::to_string(format.rate_hz) + "/1";
  const std::string source = "v4l2src device=" + format.device + " io-mode=mmap ! ";
  const std::string sink = " ! appsink name=sink sync=false max-buffers=1 drop=true";
  return format.fourcc == "MJPG"
             ? source + "image/jpeg" + size + " ! jpegdec ! videoconvert ! video/x-raw,format=GRAY8" + sink
             : source + "video/x-raw,format=GRAY16_LE" + size + sink;
}

}  // namespace

void read_by_gstreamer(const CardFormat& format, const OnPicture& on_picture) {
  gst_init(nullptr, nullptr);
  GError* error = nullptr;
  GstElement* const pipeline = gst_parse_launch(pipeline_of(format).c_str(), &error);
  if (pipeline == nullptr || error != nullptr) {
    throw std::runtime_error(std::string("GStreamer: ") +
                             (error == nullptr ? "no pipeline" : error->message));
  }
  Sink sink;
  sink.on_picture = &on_picture;
  GstElement* const app = gst_bin_get_by_name(GST_BIN(pipeline), "sink");
  GstAppSinkCallbacks callbacks{};
  callbacks.new_sample = take;
  gst_app_sink_set_callbacks(GST_APP_SINK(app), &callbacks, &sink, nullptr);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* const bus = gst_element_get_bus(pipeline);
  std::string fault;
  constexpr int kPatience = 600;  // tenths of a second
  for (int waited = 0; !sink.is_enough && fault.empty(); ++waited) {
    GstMessage* const message = gst_bus_timed_pop_filtered(
        bus, 100 * GST_MSECOND, static_cast<GstMessageType>(GST_MESSAGE_ERROR | GST_MESSAGE_EOS));
    if (message == nullptr) {
      fault = waited < kPatience ? "" : "GStreamer: too few pictures within a minute";
    } else if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) {
      fault = sink.is_enough ? "" : "GStreamer: the stream has ended";
      gst_message_unref(message);
    } else {
      gst_message_parse_error(message, &error, nullptr);
      fault = std::string("GStreamer: ") + error->message;
      gst_message_unref(message);
    }
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(app);
  gst_object_unref(pipeline);
  if (!fault.empty()) throw std::runtime_error(fault);
}

}  // namespace tubed
#endif
