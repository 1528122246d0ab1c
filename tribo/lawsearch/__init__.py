"""Laws of recorded columns: a complete search of a small grammar for what no mechanism explains."""
