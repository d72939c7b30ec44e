// scree-decoder: TIFFs by libtiff; headers of everything.
#include "tools/source/decoder_server.h"

int main() {
    return scree::serve_decoders({[] {}, scree::make_tiff_decoder});
}
