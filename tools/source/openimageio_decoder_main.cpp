// scree-decoder-openimageio: whatever OpenImageIO reads. The one program that links it and what it brings.
#include "tools/source/decoder_server.h"

int main() { return scree::serve_decoders({scree::load_openimageio, scree::make_openimageio_decoder}); }
