"""Files, engines, comparison, words and pictures around `nscd`."""
