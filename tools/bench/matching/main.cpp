#include "wide.h"
#include <iostream>
using namespace outcrop::bench;
int main(int argc,char**argv){ Descriptions d; WideOptions o; std::string only=argc>3?argv[3]:""; if(only=="ours") o.features.clear(); if(only=="sift") o.features={Feature::kSift,Feature::kAkaze};
 SiteCaseOptions c; c.site=argv[1]; c.poses=argv[2]; c.finds_all=getenv("ALL"); if(argc>4)c.images=argv[4]; auto s=load_site_case(c); auto w=measure_wide(s,o,&d); std::cout<<w.json["pairs"]<<"\n"; }
