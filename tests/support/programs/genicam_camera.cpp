// A GigE Vision camera on a loopback address, by Aravis, until it is killed:
//   genicam_camera ADDRESS SERIAL BLUE [square]
// Each image has one colour in the camera's pixel format, BayerRG8 or Mono8: red is the time of the
// image in ms (CLOCK_REALTIME) modulo 256, green the exposure time in units of 100 us plus the
// gain, and blue is BLUE. With `square`, this is the colour of its middle ninth, and all around is
// green.
#include <arv.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace {

int blue = 0;
bool is_square = false;

void fill(ArvBuffer* buffer, void*, guint32 exposure_us, guint32 gain, ArvPixelFormat format) {
  const int width_px = arv_buffer_get_image_width(buffer),
            height_px = arv_buffer_get_image_height(buffer);
  std::size_t size = 0;
  auto* const pixels =
      static_cast<unsigned char*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const auto red = static_cast<unsigned char>(g_get_real_time() / 1000 % 256),
             green = static_cast<unsigned char>(exposure_us / 100 + gain);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) {
      if (is_square && (3 * u / width_px != 1 || 3 * v / height_px != 1))
        pixels[v * width_px + u] = (u + v) % 2 != 0 ? 200 : 0;
      else
        pixels[v * width_px + u] = format == ARV_PIXEL_FORMAT_MONO_8
                                       ? static_cast<unsigned char>(blue)
                                   : (u + v) % 2 != 0 ? green
                                   : v % 2 != 0       ? static_cast<unsigned char>(blue)
                                                      : red;
    }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return 2;
  blue = std::atoi(argv[3]);
  is_square = argc == 5;
  ArvGvFakeCamera* const camera = arv_gv_fake_camera_new(argv[1], argv[2]);
  if (!arv_gv_fake_camera_is_running(camera)) return 1;
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera), fill, nullptr);
  std::puts("ready");
  std::fflush(stdout);
  for (;;) pause();
}
