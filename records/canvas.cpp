#include "records/canvas.h"

#include <memory>

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/core.h>

#include "records/output_file.h"
#include "records/picture.h"

namespace forereach {
namespace {

void Check(cairo_status_t status, const std::string& path) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw PictureError(fmt::format("picture: {} cannot be drawn: {}", path,
                                   status == CAIRO_STATUS_NO_MEMORY ? "there is not enough memory"
                                                                    : fmt::format("cairo's error {}", int{status})));
}

cairo_status_t Append(void* text, const unsigned char* bytes, unsigned int count) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

void DrawFile(const std::string& path, int width, int height, const std::function<void(cairo_t*)>& draw) {
  const bool svg = path.ends_with(".svg"), png = path.ends_with(".png");
  if (!svg && !png && !path.ends_with(".pdf"))
    throw PictureError("picture: " + path + " has to end in .svg, .png or .pdf");
  if (width < 200 || width > 10000 || height < 200 || height > 10000)
    throw PictureError(fmt::format("picture: {} x {} pixels is not within 200 to 10000", width, height));
  std::string drawn;
  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface(
      png   ? cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)
      : svg ? cairo_svg_surface_create_for_stream(&Append, &drawn, width, height)
            : cairo_pdf_surface_create_for_stream(&Append, &drawn, width, height),
      &cairo_surface_destroy);
  Check(cairo_surface_status(surface.get()), path);
  if (svg) cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  {
    const std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo(cairo_create(surface.get()), &cairo_destroy);
    draw(cairo.get());
    Check(cairo_status(cairo.get()), path);
  }
  if (png) Check(cairo_surface_write_to_png_stream(surface.get(), &Append, &drawn), path);
  cairo_surface_finish(surface.get());
  Check(cairo_surface_status(surface.get()), path);
  OutputFile file(path, OutputFile::Existing::kReplaced);
  file.Write(drawn);
  file.Close();
}

void BeginDrawing(cairo_t* cairo) {
  cairo_set_source_rgb(cairo, 1, 1, 1);
  cairo_paint(cairo);
  cairo_select_font_face(cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
}

void WriteText(cairo_t* cairo, const std::string& text, double x, double y, double size) {
  cairo_set_source_rgb(cairo, 0.13, 0.13, 0.15);
  cairo_set_font_size(cairo, size);
  cairo_move_to(cairo, x, y);
  cairo_show_text(cairo, text.c_str());
  cairo_new_path(cairo);
}

}  // namespace forereach
