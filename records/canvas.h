/** Files that are drawn with cairo: the surface of each format, and its errors. */
#pragma once

#include <functional>
#include <string>

struct _cairo;

namespace forereach {

/** Draws a .svg, .png or .pdf file by the same drawing code.
@param width, height pixels (of a .pdf points), 200 to 10000 each.
@throws PictureError (picture.h) for another ending or size, OutputError (output_file.h) if the file cannot be written:
it is whole, or not there. */
void DrawFile(const std::string& path, int width, int height, const std::function<void(_cairo*)>& draw);

/** Begins a drawing: white, and the font of all. */
void BeginDrawing(_cairo* cairo);

/** In dark ink, from the point (x, y) of its base line on. @param size pixels. */
void WriteText(_cairo* cairo, const std::string& text, double x, double y, double size);

}  // namespace forereach
