// What of Asio and Beast is not a template, for the whole program.
#include <boost/asio/impl/src.hpp>
#include <boost/beast/src.hpp>
