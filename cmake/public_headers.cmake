# Writes public headers for installation: includes of our own begin with scree/, so that no folder of a user's that is
# called common or runtime can take their place. cmake -D SOURCE=... -D OUTPUT=... -D HEADERS=a;b;c -P this
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${OUTPUT})
foreach(header IN LISTS HEADERS)
    file(READ ${SOURCE}/${header} text)
    string(REGEX REPLACE "(#include )\"(common|runtime)/" "\\1\"scree/\\2/" text "${text}")
    string(REGEX MATCHALL "#include \"scree/[^\"]+" included "${text}")
    foreach(name IN LISTS included)
        string(REGEX REPLACE ".*\"scree/" "" name ${name})
        if(NOT name IN_LIST HEADERS)
            message(FATAL_ERROR "${header} includes ${name}, which is not among the public headers (scree_public_headers)")
        endif()
    endforeach()
    # What C programs include is at the top.
    string(REGEX REPLACE "^common/c_api/" "" place ${header})
    file(WRITE ${OUTPUT}/${place} "${text}")
endforeach()
