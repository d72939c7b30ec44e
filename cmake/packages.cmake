# Debian packages by CPack: scree, scree-view and libscree-dev (scripts/package.sh makes them from the preset "package").
set(SCREE_MAINTAINER "The Scree authors <scree@localhost>" CACHE STRING "Maintainer of the packages, NAME <ADDRESS>")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME scree)
set(CPACK_PACKAGE_VENDOR "The Scree authors")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL scree scree-view dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${SCREE_MAINTAINER}")
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

# scree_package(COMPONENT PACKAGE SECTION DESCRIPTION): what is the same for all of them.
function(scree_package component package section description)
    string(TOUPPER ${component} upper)
    foreach(field SHLIBDEPS DEPENDS RECOMMENDS SUGGESTS)
        set(CPACK_DEBIAN_${upper}_PACKAGE_${field} "${package_${field}}" PARENT_SCOPE)
    endforeach()
    set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package} PARENT_SCOPE)
    set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
    set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}" PARENT_SCOPE)
    install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright ${PROJECT_BINARY_DIR}/packaging/changelog.gz
                  ${PROJECT_BINARY_DIR}/packaging/changelog.Debian.gz
            DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()

# As old as the change log.
file(TIMESTAMP ${PROJECT_SOURCE_DIR}/CHANGELOG.md changelog_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/packaging)
configure_file(packaging/changelog.Debian.in ${PROJECT_BINARY_DIR}/packaging/changelog.Debian @ONLY)
configure_file(CHANGELOG.md ${PROJECT_BINARY_DIR}/packaging/changelog COPYONLY)
execute_process(COMMAND ${SCREE_GZIP} -9nkf changelog changelog.Debian WORKING_DIRECTORY ${PROJECT_BINARY_DIR}/packaging
                COMMAND_ERROR_IS_FATAL ANY)

set(package_SHLIBDEPS ON)
set(package_SUGGESTS scree-view)
scree_package(scree scree science "builder of terrain pyramids
Cuts elevation models and orthophotos, in any CRS and any usual format, into
a pyramid of height and DXT1 texture tiles in one file, within a ceiling of
memory. Says what such a store holds, checks it, updates it, asks it for
heights, and exports parts of it.")

# Drivers are looked for when the program runs.
set(package_RECOMMENDS "libgl1, libgl1-mesa-dri")
set(package_SUGGESTS scree)
scree_package(scree-view scree-view science "flight over terrain pyramids within a pixel of the data
Draws the stores that scree builds with OpenGL 4.5, in a window or without:
tiles are paged within a fixed budget, and what is drawn stays within a given
number of pixels of the finest data. Software drivers will do.")

set(package_SHLIBDEPS OFF)
unset(package_RECOMMENDS)
set(package_SUGGESTS scree)
set(package_DEPENDS "libc6-dev, libegl-dev, libepoxy-dev, libfmt-dev, libglm-dev, libpng-dev, libsqlite3-dev, libssl-dev, \
libstdc++-12-dev | libstdc++-dev, libxxhash-dev, libzstd-dev, pkg-config | pkgconf")
scree_package(dev libscree-dev libdevel "terrain pyramids in programs of your own: library and headers
Static libraries for C++20 and CMake: scree::common reads stores, answers
heights and rays; scree::runtime chooses and pages what is to be drawn, without
OpenGL; scree::gl draws it in a context of yours. Heights from C, too.")

include(CPack)
