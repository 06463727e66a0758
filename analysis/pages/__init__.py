"""Words and pictures: what every page and chart is made with."""
